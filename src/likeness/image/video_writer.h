// Pictures to a video file, by the program ffmpeg as a child process.

#pragma once

#include <sys/types.h>

#include <cstdio>
#include <filesystem>
#include <string>

#include "likeness/image/image.h"

namespace likeness {

// Writes beside the final name and renames when complete. The ending of the name chooses the format: .mp4, .webm, .mkv.
class VideoWriter {
 public:
  // Throws Error where ffmpeg is not on the PATH, or the folder cannot be written to.
  VideoWriter(const std::filesystem::path& path, double frames_per_s);
  // Drops what is not finished.
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  // RGB, all of one size. Odd sides lose a pixel: the common formats halve the colour's. Throws Error with ffmpeg's own
  // words where it has ended.
  void Write(const ImageU8& picture);
  void Finish();

 private:
  void Start(int width, int height);
  [[noreturn]] void Fail();

  const std::filesystem::path path_;
  const std::filesystem::path temporary_;
  const double frames_per_s_;
  int width_ = 0, height_ = 0;
  pid_t process_ = -1;
  int frames_in_ = -1;
  FILE* words_ = nullptr;  // what ffmpeg says
};

}  // namespace likeness
