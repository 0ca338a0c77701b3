#include "likeness/avatar/safetensors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <limits>
#include <optional>

#include "likeness/base/file.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// A file from a header and data, with the true header length unless another is given.
std::string FileOf(const std::string& header, const std::string& data, std::optional<uint64_t> length = {}) {
  const uint64_t announced = length.value_or(header.size());
  std::string bytes(8, '\0');
  std::memcpy(bytes.data(), &announced, 8);
  return bytes + header + data;
}

std::string ErrorOfFile(const std::string& bytes) {
  static const ScratchFolder folder;
  std::ofstream(folder / "a.safetensors", std::ios::binary) << bytes;  // not WriteFile: that waits for the disk
  return ErrorOf([&] { SafetensorsFile file(folder / "a.safetensors"); });
}

TEST(Safetensors, RoundTrip) {
  const ScratchFolder folder;
  const std::vector<float> floats = {1.5f, -2, 3e-20f, 4, 5, 6};
  const std::vector<int32_t> integers = {-7, 8};
  const std::vector<double> doubles = {1.0 / 3, -1e300};
  const std::vector<float> none;
  WriteSafetensors(folder / "a.safetensors",
                   {ViewOf("b.weight", {2, 3}, floats), ViewOf("a", {2}, integers), ViewOf("d", {1, 2}, doubles),
                    ViewOf("empty", {0, 4}, none), ViewOf("scalar", {}, std::span(floats).first(1))},
                   {{"format", "x"}, {"text", "quoted \" and \n and \xc3\xa9"}});
  const SafetensorsFile file(folder / "a.safetensors");
  EXPECT_THAT(file.names(), ElementsAre("a", "b.weight", "d", "empty", "scalar"));
  EXPECT_EQ(file.Floats("b.weight", {2, -1}), floats);
  EXPECT_EQ(file.Integers("a", {2}), integers);
  EXPECT_EQ(file.Doubles("d", {-1, 2}), doubles);
  EXPECT_TRUE(file.Floats("empty", {0, 4}).empty());
  EXPECT_THAT(file.Floats("scalar", {}), ElementsAre(1.5f));
  EXPECT_EQ(file.DTypeOf("a"), DType::kI32);
  EXPECT_THAT(file.ShapeOf("b.weight"), ElementsAre(2, 3));
  EXPECT_EQ(file.Metadata("text"), "quoted \" and \n and \xc3\xa9");
  EXPECT_EQ(file.metadata().size(), 2);
}

TEST(Safetensors, BytesAreAsTheFormatSays) {
  const ScratchFolder folder;
  const std::vector<float> values = {1, 2};
  WriteSafetensors(folder / "a.safetensors", {ViewOf("x", {2}, values)}, {});
  const std::string bytes = ReadFile(folder / "a.safetensors");
  uint64_t length = 0;
  std::memcpy(&length, bytes.data(), 8);
  EXPECT_EQ((8 + length) % 64, 0);
  EXPECT_THAT(bytes.substr(8, length),
              testing::StartsWith(R"({"x":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}})"));
  EXPECT_EQ(bytes.size(), 8 + length + 8);
  std::vector<float> stored(2);
  std::memcpy(stored.data(), bytes.data() + 8 + length, 8);
  EXPECT_EQ(stored, values);
}

TEST(Safetensors, ReadsAFileOfAnotherWriter) {
  const ScratchFolder folder;
  // Unaligned data, tensors in another order than their bytes, a space after the header.
  WriteFile(folder / "a.safetensors",
            FileOf(R"({"q":{"dtype":"U8","shape":[3],"data_offsets":[4,7]},"p":{"dtype":"F32","shape":[1,1],)"
                   R"("data_offsets":[0,4]}} )",
                   std::string("\0\0\x80\x3f", 4) + "xyz"));
  const SafetensorsFile file(folder / "a.safetensors");
  EXPECT_THAT(file.Floats("p", {1, 1}), ElementsAre(1.0f));
  EXPECT_EQ(file.Bytes("q").size(), 3);
  EXPECT_THAT(ErrorOf([&] { file.Floats("q", {3}); }), HasSubstr("'q' is U8 [3]; expected F32 [3]"));
  EXPECT_THAT(ErrorOf([&] { file.Floats("p", {2}); }), HasSubstr("expected F32 [2]"));
  EXPECT_THAT(ErrorOf([&] { file.Floats("r", {2}); }), HasSubstr("no tensor 'r'"));
  EXPECT_THAT(ErrorOf([&] { file.Metadata("m"); }), HasSubstr("no metadata 'm'"));
}

TEST(Safetensors, BadHeadersAreErrorsThatNameTheFile) {
  const std::string data(8, '\0');
  const auto tensor = [](const std::string& dtype, const std::string& shape, const std::string& offsets) {
    return R"({"x":{"dtype":")" + dtype + R"(","shape":)" + shape + R"(,"data_offsets":)" + offsets + "}}";
  };
  ASSERT_EQ(ErrorOfFile(FileOf(tensor("F32", "[2]", "[0,8]"), data)), "");
  const std::pair<std::string, const char*> cases[] = {
      {"", "too short"},
      {"1234567", "too short"},
      {FileOf("{}", "", 3), "cut off"},
      {FileOf("{}", "", std::numeric_limits<uint64_t>::max()), "cut off"},
      {FileOf("{}", "", uint64_t{1} << 40), "cut off"},
      {FileOf("", ""), "not understood"},
      {FileOf("{", ""), "not understood"},
      {FileOf("[]", ""), "no JSON object"},
      {FileOf("3", ""), "no JSON object"},
      {FileOf("\xff\xfe{}", ""), "not understood"},
      {FileOf(tensor("F32", "[2]", "[0,8]") + "x", data), "not understood"},
      {FileOf(tensor("F99", "[2]", "[0,8]"), data), "'F99' is unknown"},
      {FileOf(tensor("F32", "[3]", "[0,8]"), data), "needs 12 bytes and it has 8"},
      {FileOf(tensor("F32", "[2]", "[0,8]"), data.substr(1)), "outside"},
      {FileOf(tensor("F32", "[2]", "[0,8]"), data + "x"), "belong to no tensor"},
      {FileOf(tensor("F32", "[2]", "[8,0]"), data), "outside"},
      {FileOf(tensor("F32", "[2]", "[-8,0]"), data), "whole number"},
      {FileOf(tensor("F32", "[2]", "[0.5,8]"), data), "whole number"},
      {FileOf(tensor("F32", "[2]", "[0,8,9]"), data), "no pair"},
      {FileOf(tensor("F32", "[2]", "{}"), data), "no pair"},
      {FileOf(tensor("F32", "[-2]", "[0,8]"), data), "whole number"},
      {FileOf(tensor("F32", "[1e99]", "[0,8]"), data), "whole number"},
      {FileOf(tensor("F32", "[18446744073709551615]", "[0,8]"), data), "too large"},
      {FileOf(tensor("F32", "[4611686018427387904,4,2]", "[0,8]"), data), "beyond any memory"},
      {FileOf(tensor("F32", "[1,1,1,1,1,1,1,1,2]", "[0,8]"), data), "at most 8"},
      {FileOf(tensor("F32", "2", "[0,8]"), data), "at most 8"},
      {FileOf(tensor("F32", "[[2]]", "[0,8]"), data), "nested too deeply"},
      {FileOf(std::string(100000, '[') + std::string(100000, ']'), ""), "nested too deeply"},
      {FileOf(R"({"x":3})", ""), "tensor 'x'"},
      {FileOf(R"({"x":{"dtype":"F32","shape":[2]}})", data), "data_offsets"},
      {FileOf(R"({"__metadata__":{"a":3}})", ""), "not understood"},
      {FileOf(R"({"__metadata__":[]})", ""), "not understood"},
      {FileOf(R"({"x":{"dtype":"F32","shape":[1],"data_offsets":[0,4]},"x":{"dtype":"F32","shape":[1],)"
              R"("data_offsets":[4,8]}})",
              data),
       "'x' twice"},
      {FileOf(R"({"x":{"dtype":"F32","shape":[2],"data_offsets":[0,8]},"y":{"dtype":"F32","shape":[1],)"
              R"("data_offsets":[4,8]}})",
              data),
       "overlap"},
      {FileOf(R"({"x":{"dtype":"U8","shape":[2],"data_offsets":[0,2]},"y":{"dtype":"F32","shape":[1],)"
              R"("data_offsets":[4,8]}})",
              data),
       "hole"},
  };
  for (const auto& [bytes, expected] : cases) {
    const std::string error = ErrorOfFile(bytes);
    EXPECT_THAT(error, HasSubstr(expected)) << bytes.substr(0, 200);
    EXPECT_THAT(error, HasSubstr("a.safetensors"));
  }
}

TEST(Safetensors, NonFiniteFloatsAreRefused) {
  const ScratchFolder folder;
  const std::vector<float> values = {1, std::numeric_limits<float>::quiet_NaN()};
  WriteSafetensors(folder / "a.safetensors", {ViewOf("x", {2}, values)}, {});
  const SafetensorsFile file(folder / "a.safetensors");
  EXPECT_THAT(ErrorOf([&] { file.Floats("x", {2}); }), HasSubstr("value 1 is not a finite"));
}

// Whatever a file holds, it is read or refused with an Error; the sanitizers watch.
TEST(Safetensors, SurvivesDamage) {
  const ScratchFolder folder;
  const std::vector<float> values = {1, 2, 3, 4};
  WriteSafetensors(folder / "a.safetensors",
                   {ViewOf("x", {2, 2}, values), ViewOf("y", {2}, std::span(values).first(2))}, {{"format", "x"}});
  const std::string good = ReadFile(folder / "a.safetensors");
  for (size_t cut = 0; cut < good.size(); ++cut) EXPECT_NE(ErrorOfFile(good.substr(0, cut)), "") << cut;
  Random random(1);
  int refused = 0;
  for (int i = 0; i < 500; ++i) {
    std::string bytes = good;
    for (int k = 0; k < 3; ++k)
      bytes[random.Below(static_cast<int64_t>(bytes.size()))] = static_cast<char>(random.Next());
    refused += ErrorOfFile(bytes).empty() ? 0 : 1;
  }
  EXPECT_GT(refused, 250);
}

}  // namespace
}  // namespace likeness
