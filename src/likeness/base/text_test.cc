#include "likeness/base/text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/testing.h"

namespace likeness {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(TextLinesTest, SplitsLinesWordsAndFields) {
  TextLines lines("f", "\xef\xbb\xbf a  b\t c\r\n\n1, 2,,3");
  ASSERT_TRUE(lines.Next());
  EXPECT_THAT(lines.Words(), ElementsAre("a", "b", "c"));
  ASSERT_TRUE(lines.Next());
  EXPECT_TRUE(lines.Words().empty());
  ASSERT_TRUE(lines.Next());
  EXPECT_THAT(lines.Fields(','), ElementsAre("1", "2", "", "3"));
  EXPECT_FALSE(lines.Next());
}

TEST(TextLinesTest, ErrorsNameFileAndLine) {
  TextLines lines("k.txt", "1 2 3\n1 nan 3\n1e999 2 3\nx 2 3");
  ASSERT_TRUE(lines.Next());
  EXPECT_THAT(lines.Numbers(3), ElementsAre(1, 2, 3));
  EXPECT_THAT(ErrorOf([&] { lines.Numbers(4); }), HasSubstr("k.txt:1: expected 4 numbers, found 3"));
  ASSERT_TRUE(lines.Next());
  EXPECT_THAT(ErrorOf([&] { lines.Numbers(3); }), HasSubstr("k.txt:2: expected a finite number, found 'nan'"));
  ASSERT_TRUE(lines.Next());
  EXPECT_THAT(ErrorOf([&] { lines.Numbers(3); }), HasSubstr("k.txt:3:"));
  ASSERT_TRUE(lines.Next());
  EXPECT_THAT(ErrorOf([&] { lines.Integer("12x"); }), HasSubstr("k.txt:4: expected a whole number"));
}

TEST(NearestWordTest, FindsTyposAndLeavesStrangersAlone) {
  EXPECT_EQ(NearestWord("--thread", {"--threads", "--seed"}), "--threads");
  EXPECT_EQ(NearestWord("zzzzzzzzz", {"train", "render"}), "");
}

}  // namespace
}  // namespace likeness
