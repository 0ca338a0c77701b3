#include "likeness/train/tensorboard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <optional>

#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

// A protocol-buffer reader of its own: field number -> values, integers and fixed numbers as bits.
struct Field {
  uint64_t number = 0;
  std::string bytes;
};
using Fields = std::multimap<uint32_t, Field>;

uint64_t Varint(std::string_view& text) {
  uint64_t value = 0;
  for (int shift = 0;; shift += 7) {
    const auto byte = static_cast<uint8_t>(text.at(0));
    text.remove_prefix(1);
    value |= static_cast<uint64_t>(byte & 0x7f) << shift;
    if ((byte & 0x80) == 0) return value;
  }
}

Fields Parse(std::string_view text) {
  Fields fields;
  while (!text.empty()) {
    const uint64_t key = Varint(text);
    Field field;
    size_t length = 0;
    switch (key & 7) {
      case 0:
        field.number = Varint(text);
        break;
      case 1:
        length = 8;
        break;
      case 2:
        length = Varint(text);
        break;
      case 5:
        length = 4;
        break;
      default:
        ADD_FAILURE() << "wire type " << (key & 7);
        return fields;
    }
    field.bytes = std::string(text.substr(0, length));
    EXPECT_EQ(field.bytes.size(), length);
    if ((key & 7) != 2)
      std::memcpy(&field.number, field.bytes.data(), std::min<size_t>(8, (key & 7) == 0 ? 0 : length));
    text.remove_prefix(length);
    fields.emplace(static_cast<uint32_t>(key >> 3), field);
  }
  return fields;
}

std::vector<std::string> Records(const std::string& file) {
  std::vector<std::string> records;
  for (size_t at = 0; at < file.size();) {
    uint64_t length = 0;
    uint32_t length_crc = 0, crc = 0;
    std::memcpy(&length, file.data() + at, 8);
    std::memcpy(&length_crc, file.data() + at + 8, 4);
    EXPECT_EQ(length_crc, MaskedCrc32c(file.substr(at, 8)));
    records.push_back(file.substr(at + 12, length));
    std::memcpy(&crc, file.data() + at + 12 + length, 4);
    EXPECT_EQ(crc, MaskedCrc32c(records.back()));
    at += 12 + length + 4;
  }
  return records;
}

TEST(TensorBoard, Crc32cOfKnownStrings) {
  EXPECT_EQ(Crc32c("123456789"), 0xe3069283u);            // the catalogue's check value
  EXPECT_EQ(Crc32c(std::string(32, '\0')), 0x8a9136aau);  // RFC 3720, appendix B.4
  EXPECT_EQ(Crc32c(""), 0u);
}

TEST(TensorBoard, EventsParseBack) {
  const ScratchFolder folder;
  ImageU8 image(3, 2, 3);
  for (size_t i = 0; i < image.values().size(); ++i) image.values()[i] = static_cast<uint8_t>(10 * i);
  std::filesystem::path path;
  {
    TensorBoardWriter writer(folder / "events");
    writer.WriteScalars(300, {{"loss/total", 0.25}, {"loss/kl", -3e-8}});
    writer.WriteImage(1'000'000'000'000, "texture", image);
    path = writer.path();
  }
  EXPECT_THAT(path.filename().string(), testing::StartsWith("events.out.tfevents."));
  const std::vector<std::string> records = Records(ReadFile(path));
  ASSERT_EQ(records.size(), 3);
  EXPECT_EQ(Parse(records[0]).find(3)->second.bytes, "brain.Event:2");

  const Fields scalars = Parse(records[1]);
  EXPECT_EQ(scalars.find(2)->second.number, 300);
  double time = 0;
  std::memcpy(&time, scalars.find(1)->second.bytes.data(), 8);
  EXPECT_GT(time, 1.7e9);
  const Fields summary = Parse(scalars.find(5)->second.bytes);
  std::map<std::string, float> values;
  for (auto it = summary.lower_bound(1); it != summary.upper_bound(1); ++it) {
    const Fields value = Parse(it->second.bytes);
    float number = 0;
    std::memcpy(&number, value.find(2)->second.bytes.data(), 4);
    values[value.find(1)->second.bytes] = number;
  }
  EXPECT_EQ(values, (std::map<std::string, float>{{"loss/total", 0.25f}, {"loss/kl", -3e-8f}}));

  const Fields event = Parse(records[2]);
  EXPECT_EQ(event.find(2)->second.number, 1'000'000'000'000);
  const Fields value = Parse(Parse(event.find(5)->second.bytes).find(1)->second.bytes);
  EXPECT_EQ(value.find(1)->second.bytes, "texture");
  const Fields picture = Parse(value.find(4)->second.bytes);
  EXPECT_EQ(picture.find(1)->second.number, 2);
  EXPECT_EQ(picture.find(2)->second.number, 3);
  EXPECT_EQ(picture.find(3)->second.number, 3);
  WriteFile(folder / "picture.png", picture.find(4)->second.bytes);
  EXPECT_EQ(ReadImage(folder / "picture.png"), image);
}

TEST(TensorBoard, AFolderThatCannotBeMadeIsAnError) {
  const ScratchFolder folder;
  WriteFile(folder / "file", "");
  EXPECT_THAT(ErrorOf([&] { TensorBoardWriter(folder / "file"); }), testing::HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace likeness
