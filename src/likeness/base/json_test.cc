#include "likeness/base/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "likeness/base/testing.h"

namespace likeness {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string Nested(size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); }

TEST(JsonTest, ReadsValues) {
  EXPECT_EQ(ParseJson("a.json", R"({"a": [1, 2.5, "x"]})").at("a").size(), 3u);
  EXPECT_EQ(ParseJson("a.json", "7"), 7);
}

TEST(JsonTest, WrongTextsAreErrors) {
  const auto error = [](const std::string& text) { return ErrorOf([&] { ParseJson("a.json", text); }); };
  EXPECT_THAT(error(""), StartsWith("a.json: is no JSON"));
  EXPECT_THAT(error("{} x"), StartsWith("a.json: is no JSON"));
  EXPECT_THAT(error("\"\xff\""), StartsWith("a.json: is no JSON"));
  EXPECT_EQ(error(Nested(64)), "");
  EXPECT_THAT(error(Nested(65)), HasSubstr("nested more than 64 deep"));
  EXPECT_THAT(error(Nested(1'000'000)), HasSubstr("nested more than 64 deep"));
}

}  // namespace
}  // namespace likeness
