#include "likeness/image/video_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "likeness/base/file.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

// ffmpeg is a script here, in a folder that comes first.
class VideoWriterTest : public testing::Test {
 protected:
  ~VideoWriterTest() override { setenv("PATH", path_.c_str(), 1); }
  void Ffmpeg(const std::string& script) {
    WriteFile(scratch_ / "bin" / "ffmpeg", "#!/bin/sh\n" + script);
    fs::permissions(scratch_ / "bin" / "ffmpeg", fs::perms::owner_all);
    setenv("PATH", ((scratch_ / "bin").string() + ":" + path_).c_str(), 1);
  }
  const std::string path_ = std::getenv("PATH");
  const ScratchFolder scratch_;
  const fs::path video_ = scratch_ / "videos" / "a.mp4";
};

TEST_F(VideoWriterTest, GivesEveryByteOfEvenSides) {
  // The output's name is the last argument.
  Ffmpeg("for last; do :; done; echo \"$@\" > " + (scratch_ / "arguments").string() + "; cat > \"${last#file:}\"\n");
  std::string expected;
  {
    VideoWriter writer(video_, 12.5);
    for (size_t i = 0; i < 5; ++i) {
      ImageU8 picture(7, 4, 3);
      for (size_t k = 0; k < picture.values().size(); ++k) picture.values()[k] = static_cast<uint8_t>(k + 31 * i);
      for (int y = 0; y < 4; ++y) expected.append(reinterpret_cast<const char*>(picture.row(y)), 18);
      writer.Write(picture);
    }
    EXPECT_FALSE(fs::exists(video_));
    writer.Finish();
  }
  EXPECT_EQ(ReadFile(video_), expected);
  EXPECT_EQ(ListFolder(video_.parent_path()).size(), 1u);
  EXPECT_THAT(ReadFile(scratch_ / "arguments"), AllOf(HasSubstr("6x4"), HasSubstr("-framerate 12.5")));
}

TEST_F(VideoWriterTest, FailuresAreToldAndLeaveNothing) {
  const auto write = [&](int pictures) {
    return ErrorOf([&] {
      VideoWriter writer(video_, 30);
      for (int i = 0; i < pictures; ++i) writer.Write(ImageU8(640, 480, 3));
      writer.Finish();
    });
  };
  Ffmpeg("head -c 1000 >/dev/null; echo 'Unknown encoder' >&2; exit 1\n");
  EXPECT_THAT(write(20), AllOf(HasSubstr("a.mp4"), HasSubstr("Unknown encoder")));
  Ffmpeg("cat >/dev/null; echo 'No space left' >&2; exit 1\n");
  EXPECT_THAT(write(2), HasSubstr("No space left"));
  Ffmpeg("cat >/dev/null\n");
  EXPECT_THAT(write(2), HasSubstr("without a word"));
  EXPECT_TRUE(ListFolder(video_.parent_path()).empty());
  setenv("PATH", (scratch_ / "nothing").c_str(), 1);
  EXPECT_THAT(write(1), AllOf(HasSubstr("not on the PATH"), HasSubstr("apt install ffmpeg")));
}

TEST_F(VideoWriterTest, WhatIsNotFinishedIsDropped) {
  Ffmpeg("for last; do :; done; cat > \"${last#file:}\"\n");
  {
    VideoWriter writer(video_, 30);
    for (int i = 0; i < 3; ++i) writer.Write(ImageU8(64, 48, 3));
  }
  EXPECT_TRUE(ListFolder(video_.parent_path()).empty());
}

}  // namespace
}  // namespace likeness
