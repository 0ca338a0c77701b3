#include "likeness/avatar/multiface/torch_archive.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zip.h>

#include <cstring>

#include "likeness/base/file.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using namespace std::string_literals;  // bytes with zeros among them

std::string Little(uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i));
  return text;
}
std::string Text(const std::string& text) { return "X"s + Little(text.size(), 4) + text; }
std::string Int(int64_t value) { return "\x8a\x08"s + Little(static_cast<uint64_t>(value), 8); }
std::string Tuple(const std::vector<std::string>& items) {
  std::string text = "(";
  for (const std::string& item : items) text += item;
  return text + "t";
}
std::string Shape(const std::vector<int64_t>& extents) {
  std::vector<std::string> items;
  for (const int64_t extent : extents) items.push_back(Int(extent));
  return Tuple(items);
}

// "name": a tensor of the storage `entry`.
std::string Entry(const std::string& name, const std::string& type, const std::string& entry, int64_t offset,
                  const std::vector<int64_t>& shape, const std::vector<int64_t>& strides) {
  const std::string storage =
      Tuple({Text("storage"), "ctorch\n"s + type + "\n", Text(entry), Text("cpu"), Int(99)}) + "Q";
  return Text(name) + "ctorch._utils\n_rebuild_tensor_v2\n" +
         Tuple({storage, Int(offset), Shape(shape), Shape(strides), "\x89", "ccollections\nOrderedDict\n)R"}) + "R";
}

std::string Dictionary(const std::string& entries) { return "\x80\x02}("s + entries + "u."; }

template <typename T>
std::string Bytes(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

using Entries = std::map<std::string, std::string>;

// The file as torch.save would have written it.
std::string Zip(const Entries& entries, bool stored = true) {
  const ScratchFolder folder;
  const std::string path = folder / "a.pth";
  zip_t* zip = zip_open(path.c_str(), ZIP_CREATE, nullptr);
  for (const auto& [name, bytes] : entries) {
    zip_source_t* source = zip_source_buffer(zip, bytes.data(), bytes.size(), 0);
    const zip_int64_t index = zip_file_add(zip, ("archive/"s + name).c_str(), source, 0);
    zip_set_file_compression(zip, index, stored ? ZIP_CM_STORE : ZIP_CM_DEFLATE, 0);
  }
  zip_close(zip);
  return ReadFile(path);
}

std::string ErrorIn(const std::string& bytes) {
  return ErrorOf([&] { ParseTorchArchive("a.pth", bytes); });
}

TEST(TorchArchive, ReadsTypesOffsetsAndStrides) {
  const std::vector<float> floats = {0, 1, 2, 3, 4, 5, 6, 7};
  const std::string pickle = Dictionary(
      Entry("whole", "FloatStorage", "0", 0, {2, 4}, {4, 1}) + Entry("turned", "FloatStorage", "0", 1, {3, 2}, {1, 4}) +
      Entry("scalar", "FloatStorage", "0", 7, {}, {}) + Entry("none", "FloatStorage", "0", 0, {0, 5}, {5, 1}) +
      Text("epoch") + Int(3) + Entry("half", "HalfStorage", "1", 0, {6}, {1}) +
      Entry("brain", "BFloat16Storage", "2", 0, {2}, {1}) + Entry("double", "DoubleStorage", "3", 0, {1}, {1}));
  const auto tensors =
      ParseTorchArchive("a.pth", Zip({{"data.pkl", pickle},
                                      {"byteorder", "little"},
                                      {"data/0", Bytes(floats)},
                                      // 1, -2, 2^-24, 65504, infinity, -0
                                      {"data/1", Bytes<uint16_t>({0x3c00, 0xc000, 0x0001, 0x7bff, 0x7c00, 0x8000})},
                                      {"data/2", Bytes<uint16_t>({0x3f80, 0xc040})},
                                      {"data/3", Bytes<double>({0.25})}}));
  ASSERT_EQ(tensors.size(), 7);
  EXPECT_EQ(tensors.at("whole").values, floats);
  EXPECT_THAT(tensors.at("whole").shape, ElementsAre(2, 4));
  EXPECT_THAT(tensors.at("turned").values, ElementsAre(1, 5, 2, 6, 3, 7));
  EXPECT_THAT(tensors.at("scalar").values, ElementsAre(7));
  EXPECT_TRUE(tensors.at("none").values.empty());
  EXPECT_THAT(tensors.at("half").values,
              ElementsAre(1, -2, std::ldexp(1.0f, -24), 65504, std::numeric_limits<float>::infinity(), 0));
  EXPECT_TRUE(std::signbit(tensors.at("half").values[5]));
  EXPECT_THAT(tensors.at("brain").values, ElementsAre(1, -3));
  EXPECT_THAT(tensors.at("double").values, ElementsAre(0.25f));
}

// A state_dict with metadata, as modules have it: OrderedDict, SETITEMS, BUILD.
TEST(TorchArchive, ReadsAnOrderedDictWithAttributes) {
  const std::string pickle = "\x80\x02" + "ccollections\nOrderedDict\n)R("s +
                             Entry("a", "FloatStorage", "0", 0, {1}, {1}) + "u}" + Text("_metadata") + "}sb.";
  const auto tensors = ParseTorchArchive("a.pth", Zip({{"data.pkl", pickle}, {"data/0", Bytes<float>({5})}}));
  EXPECT_THAT(tensors.at("a").values, ElementsAre(5));
}

TEST(TorchArchive, RefusesWhatDoesNotFit) {
  const std::string storage = Bytes<float>({0, 1, 2, 3});
  const auto error = [&](const std::string& pickle) {
    return ErrorIn(Zip({{"data.pkl", pickle}, {"data/0", storage}}));
  };
  const auto tensor = [&](const std::string& type, int64_t offset, const std::vector<int64_t>& shape,
                          const std::vector<int64_t>& strides) {
    return error(Dictionary(Entry("t", type, "0", offset, shape, strides)));
  };
  ASSERT_EQ(tensor("FloatStorage", 0, {4}, {1}), "");
  EXPECT_THAT(tensor("FloatStorage", 1, {4}, {1}), HasSubstr("'t' reaches beyond its storage"));
  EXPECT_THAT(tensor("FloatStorage", 0, {4}, {2}), HasSubstr("beyond"));
  EXPECT_THAT(tensor("DoubleStorage", 0, {4}, {1}), HasSubstr("beyond"));
  EXPECT_THAT(tensor("FloatStorage", 0, {int64_t{1} << 62, 8}, {0, 0}), HasSubstr("beyond"));
  EXPECT_THAT(tensor("FloatStorage", 0, {2, 2}, {int64_t{1} << 62, int64_t{1} << 62}), HasSubstr("beyond"));
  EXPECT_THAT(tensor("FloatStorage", 0, {int64_t{1} << 40}, {0}), HasSubstr("more values than the file has bytes"));
  EXPECT_THAT(tensor("FloatStorage", -1, {4}, {1}), HasSubstr("odd shape"));
  EXPECT_THAT(tensor("FloatStorage", 0, {-4}, {1}), HasSubstr("odd shape"));
  EXPECT_THAT(tensor("FloatStorage", 0, {4}, {}), HasSubstr("odd shape"));
  EXPECT_THAT(tensor("FloatStorage", 0, {1, 1, 1, 1, 1, 1, 1, 1, 1}, {1, 1, 1, 1, 1, 1, 1, 1, 1}),
              HasSubstr("odd shape"));
  EXPECT_THAT(tensor("QInt8Storage", 0, {4}, {1}), HasSubstr("'torch QInt8Storage'"));
  EXPECT_THAT(error(Dictionary(Entry("t", "FloatStorage", "1", 0, {4}, {1}))), HasSubstr("lacks its entry data/1"));
  EXPECT_THAT(error(Dictionary(Entry("t", "FloatStorage", "../../etc/passwd", 0, {4}, {1}))), HasSubstr("lacks"));
  EXPECT_THAT(error(Dictionary("")), HasSubstr("no tensors"));
  EXPECT_THAT(error("N."), HasSubstr("no dictionary"));
  EXPECT_THAT(error(Dictionary(Text("t") + "cos\nsystem\n" + Tuple({Text("true")}) + "R")), HasSubstr("no tensors"));
  std::string shared;
  for (int i = 0; i < 1000; ++i) shared += Entry(fmt::format("t{}", i), "FloatStorage", "0", 0, {1}, {1});
  EXPECT_EQ(error(Dictionary(shared)), "");  // small, if odd
}

TEST(TorchArchive, RefusesOtherFiles) {
  EXPECT_THAT(ErrorIn(""), HasSubstr("a.pth: is a zip without data.pkl"));  // to libzip an empty file is an empty zip
  EXPECT_THAT(ErrorIn("\x80\x02."), HasSubstr("a.pth: is no checkpoint in PyTorch's zip format"));
  EXPECT_THAT(ErrorIn(Zip({{"other", "x"}})), HasSubstr("without data.pkl"));
  const std::string pickle = Dictionary(Entry("t", "FloatStorage", "0", 0, {400}, {1}));
  const std::string zeros(1600, '\0');
  EXPECT_EQ(ErrorIn(Zip({{"data.pkl", pickle}, {"data/0", zeros}})), "");
  EXPECT_THAT(ErrorIn(Zip({{"data.pkl", pickle}, {"data/0", zeros}}, /*stored=*/false)), HasSubstr("compressed"));
  EXPECT_THAT(ErrorIn(Zip({{"data.pkl", pickle}, {"data/0", zeros}, {"byteorder", "big"}})), HasSubstr("'big'"));
}

TEST(TorchArchive, SurvivesDamage) {
  const std::string good = Zip(
      {{"data.pkl", Dictionary(Entry("t", "FloatStorage", "0", 0, {4}, {1}))}, {"data/0", Bytes<float>({0, 1, 2, 3})}});
  Random random(5);
  for (int trial = 0; trial < 1000; ++trial) {
    std::string bytes = good;
    for (int change = 0; change < 3; ++change) {
      bytes[random.Below(static_cast<int64_t>(bytes.size()))] = static_cast<char>(random.Below(256));
    }
    if (trial % 3 == 0) bytes.resize(random.Below(static_cast<int64_t>(bytes.size())));
    ErrorIn(bytes);
  }
}

}  // namespace
}  // namespace likeness
