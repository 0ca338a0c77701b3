#include "likeness/base/file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "likeness/base/error.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using ::testing::HasSubstr;

TEST(FileTest, WritesWholeAndMakesFolders) {
  const ScratchFolder scratch;
  WriteFile(scratch / "a/b/c.txt", "hello");
  EXPECT_EQ(ReadFile(scratch / "a/b/c.txt"), "hello");
  EXPECT_EQ(ListFolder(scratch / "a/b"), std::vector<std::string>{"c.txt"});
}

TEST(FileTest, AFailedWriteLeavesTheOldFileAndNothingElse) {
  const ScratchFolder scratch;
  WriteFile(scratch / "x.txt", "old");
  EXPECT_THROW(WriteFileWith(scratch / "x.txt",
                             [](const std::filesystem::path& temporary) {
                               WriteFile(temporary, "half");
                               throw Error("full disk");
                             }),
               Error);
  EXPECT_EQ(ReadFile(scratch / "x.txt"), "old");
  EXPECT_EQ(ListFolder(scratch.path()).size(), 1u);
}

TEST(FileTest, ErrorsNameTheFile) {
  const ScratchFolder scratch;
  EXPECT_THAT(ErrorOf([&] { ReadFile(scratch / "absent"); }), HasSubstr("absent: no such file"));
  EXPECT_THAT(ErrorOf([&] { ReadFile(scratch.path()); }), HasSubstr("expected a file"));
  WriteFile(scratch / "big", std::string(100, 'x'));
  EXPECT_THAT(ErrorOf([&] { ReadFile(scratch / "big", 99); }), HasSubstr("at most 99"));
}

TEST(FileTest, FloatsAreCheckedForCountAndFiniteness) {
  const ScratchFolder scratch;
  const std::vector<float> values = {1, 2, 3};
  WriteFloats(scratch / "v.bin", values);
  EXPECT_EQ(ReadFloats(scratch / "v.bin", 3), values);
  EXPECT_TRUE(ParseFloats("empty.bin", "").empty());
  EXPECT_THAT(ErrorOf([&] { ReadFloats(scratch / "v.bin", 4); }), HasSubstr("expected 4 float32 values, 16 bytes"));
  WriteFile(scratch / "odd.bin", "12345");
  EXPECT_THAT(ErrorOf([&] { ReadFloats(scratch / "odd.bin"); }), HasSubstr("not a whole number"));
  WriteFloats(scratch / "nan.bin", std::vector<float>{0, std::numeric_limits<float>::quiet_NaN()});
  EXPECT_THAT(ErrorOf([&] { ReadFloats(scratch / "nan.bin"); }), HasSubstr("value 1 is not a finite number"));
}

}  // namespace
}  // namespace likeness
