#include "likeness/texture/unwrap_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/testing.h"

namespace likeness {
namespace {

using ::testing::StartsWith;

TEST(UnwrapRecordTest, ReadsBackWhatIsWritten) {
  UnwrapRecord record = {72.1, true, {"01", "camera \"x\""}, ""};
  EXPECT_EQ(ParseUnwrapRecord("state.json", UnwrapRecordText(record)), record);
  record.statistics = "0123456789abcdef";
  EXPECT_EQ(ParseUnwrapRecord("state.json", UnwrapRecordText(record)), record);
}

TEST(UnwrapRecordTest, OtherTextsAreErrors) {
  const auto error = [](const std::string& text) { return ErrorOf([&] { ParseUnwrapRecord("state.json", text); }); };
  EXPECT_THAT(error("{"), StartsWith("state.json: is no JSON"));
  for (const char* text :
       {"null", "[]", "{}", R"({"textures": []})", R"({"textures": {"grazing_deg": 80}})",
        R"({"textures": {"grazing_deg": "80", "masks": true}, "training_cameras": []})",
        R"({"textures": {"grazing_deg": 80, "masks": true}, "training_cameras": [1]})",
        R"({"textures": {"grazing_deg": 80, "masks": true}, "training_cameras": [], "statistics": 1})"}) {
    EXPECT_THAT(error(text), StartsWith("state.json: is no record")) << text;
  }
}

}  // namespace
}  // namespace likeness
