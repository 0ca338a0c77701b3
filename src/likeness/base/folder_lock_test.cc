#include "likeness/base/folder_lock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "likeness/base/testing.h"

namespace likeness {
namespace {

TEST(FolderLock, OneAtATime) {
  const ScratchFolder scratch;
  const auto folder = scratch / "new" / "folder";
  auto first = std::make_unique<FolderLock>(folder);
  EXPECT_THAT(ErrorOf([&] { FolderLock second(folder); }), testing::HasSubstr("another process"));
  first.reset();
  EXPECT_EQ(ErrorOf([&] { FolderLock second(folder); }), "");
}

TEST(FolderLock, SaysWhereItCannotBe) {
  const ScratchFolder scratch;
  EXPECT_THAT(ErrorOf([&] { FolderLock lock("/proc/nowhere"); }), testing::HasSubstr("/proc/nowhere"));
}

}  // namespace
}  // namespace likeness
