#include "likeness/base/mapped_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/file.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

TEST(MappedFile, HasTheFilesBytes) {
  const ScratchFolder folder;
  WriteFile(folder / "a", std::string("x\0y", 3));
  EXPECT_EQ(MappedFile(folder / "a").bytes(), std::string("x\0y", 3));
  WriteFile(folder / "empty", "");
  EXPECT_EQ(MappedFile(folder / "empty").bytes(), "");
}

TEST(MappedFile, NamesWhatCannotBeMapped) {
  const ScratchFolder folder;
  EXPECT_THAT(ErrorOf([&] { MappedFile(folder / "absent"); }), testing::HasSubstr("absent: no such file"));
  EXPECT_THAT(ErrorOf([&] { MappedFile(folder.path()); }), testing::HasSubstr("expected a file"));
}

}  // namespace
}  // namespace likeness
