#include "likeness/app/picture_output.h"

#include <fmt/format.h>
#include <unistd.h>

#include <utility>

#include "likeness/app/command.h"
#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/image/image_io.h"
#include "likeness/image/video_writer.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

class OnePicture : public PictureOutput {
 public:
  explicit OnePicture(fs::path path) : path_(std::move(path)) {}
  void Write(const ImageU8& picture) override { picture_ = picture; }
  void Finish() override { WritePng(path_, picture_); }

 private:
  const fs::path path_;
  ImageU8 picture_;
};

class PictureFolder : public PictureOutput {
 public:
  explicit PictureFolder(fs::path folder)
      : folder_(std::move(folder)),
        temporary_(folder_.parent_path() / fmt::format(".{}.{}.partial", folder_.filename().string(), getpid())) {
    std::error_code code;
    if (fs::exists(folder_, code) && !fs::is_empty(folder_, code)) {
      throw FileError(folder_, "is there already and not empty; give another name, or remove it");
    }
    fs::create_directories(temporary_, code);
    if (code) throw FileError(temporary_, "cannot make this folder: " + code.message());
  }
  ~PictureFolder() override {
    std::error_code ignored;
    fs::remove_all(temporary_, ignored);
  }
  PictureFolder(const PictureFolder&) = delete;
  PictureFolder& operator=(const PictureFolder&) = delete;

  void Write(const ImageU8& picture) override { WritePng(temporary_ / fmt::format("{:06}.png", count_++), picture, 1); }
  void Finish() override {
    std::error_code code;
    fs::rename(temporary_, folder_, code);
    if (code) throw FileError(folder_, "cannot be written: " + code.message());
  }

 private:
  const fs::path folder_, temporary_;
  int count_ = 0;
};

class Video : public PictureOutput {
 public:
  Video(const fs::path& path, double frames_per_s) : writer_(path, frames_per_s) {}
  void Write(const ImageU8& picture) override { writer_.Write(picture); }
  void Finish() override { writer_.Finish(); }

 private:
  VideoWriter writer_;
};

}  // namespace

std::unique_ptr<PictureOutput> OpenPictureOutput(const fs::path& out, size_t pictures, bool transparent,
                                                 double frames_per_s) {
  const std::string ending = out.extension().string();
  if (!out.has_filename()) return std::make_unique<PictureFolder>(out.parent_path());
  if (ending == ".png") {
    if (pictures == 1) return std::make_unique<OnePicture>(out);
    throw UsageError(fmt::format(
        "{} pictures do not go into one PNG; OUT is a video, such as OUT.mp4, or a folder with a slash, OUT/",
        pictures));
  }
  if (ending == ".mp4" || ending == ".webm" || ending == ".mkv") {
    if (!transparent) return std::make_unique<Video>(out, frames_per_s);
    throw UsageError("videos have no --transparent background; OUT is a PNG, or a folder with a slash, OUT/");
  }
  throw UsageError(fmt::format(
      "OUT is '{}'; expected NAME.png, NAME.mp4, .webm or .mkv, or a folder with a slash, NAME/", out.string()));
}

fs::path TomlBeside(const fs::path& out) {
  if (out.has_filename()) return fs::path(out).replace_extension(".toml");
  return out.parent_path().concat(".toml");
}

}  // namespace likeness
