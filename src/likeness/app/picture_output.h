// Where rendered pictures go: one PNG, a folder of PNGs, or a video.

#pragma once

#include <filesystem>
#include <memory>

#include "likeness/image/image.h"

namespace likeness {

class PictureOutput {
 public:
  virtual ~PictureOutput() = default;  // drops what is not finished
  // RGB, or RGBA but for videos; all of one size.
  virtual void Write(const ImageU8& picture) = 0;
  // What was written gets its final name.
  virtual void Finish() = 0;
};

// Tells by the name: OUT.png takes one picture; OUT/, with the slash, is a folder that must not exist or be empty, for
// 000000.png and so on; OUT.mp4, .webm and .mkv are videos. Throws UsageError when the name does not go with the number
// of pictures or with transparency, and Error when ffmpeg is missing or the folder is there.
std::unique_ptr<PictureOutput> OpenPictureOutput(const std::filesystem::path& out, size_t pictures, bool transparent,
                                                 double frames_per_s);

// Beside the output, for the options that made it.
std::filesystem::path TomlBeside(const std::filesystem::path& out);

}  // namespace likeness
