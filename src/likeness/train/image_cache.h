// Textures and camera images of a capture as training keeps them: packed, in memory as far as a budget goes, then in a
// file.

#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "likeness/image/image.h"

namespace likeness {

// An RGB image of which a part counts: a bit a pixel that says so, then the colours of those that do. A face takes
// about half of its texture and a camera sees about half of the face, and a head takes about a third of a picture: a
// quarter to a half of the bytes.
class PackedImage {
 public:
  PackedImage() = default;
  //   counts  1 channel, 0 where a pixel does not; empty: where it is (0, 0, 0)
  PackedImage(const ImageU8& image, const ImageU8& counts);

  // `image` is 0 where it does not count; `counts` is 255 or 0.
  void Unpack(int width, int height, ImageU8* image, ImageU8* counts) const;

  std::vector<uint8_t>& bytes() { return bytes_; }
  const std::vector<uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<uint8_t> bytes_;
};

// Images by number, each made when it is first asked for. Safe from several threads.
class ImageCache {
 public:
  using Make = std::function<PackedImage(int)>;

  //   make          reads an image from its source; may throw
  //   memory_bytes  for images in memory at most
  //   folder        those beyond go to a file in there, which has no name and goes with this object or the process;
  //                 empty: they are made again. A disk that is full does the same.
  // Throws Error when the folder cannot be written to.
  ImageCache(int count, Make make, size_t memory_bytes, const std::filesystem::path& folder);
  ~ImageCache();
  ImageCache(const ImageCache&) = delete;
  ImageCache& operator=(const ImageCache&) = delete;

  std::shared_ptr<const PackedImage> Get(int index);

  size_t memory_bytes() const { return memory_used_; }
  size_t file_bytes() const { return static_cast<size_t>(file_end_.load()); }
  int64_t made() const { return made_; }  // calls of `make`

 private:
  struct Slot {
    std::once_flag once;
    std::shared_ptr<const PackedImage> packed;  // in memory
    int64_t offset = -1;                        // in the file
    size_t size = 0;
  };
  std::shared_ptr<const PackedImage> MakeOne(int index);
  bool KeepInMemory(size_t size);
  bool KeepInFile(Slot* slot, const PackedImage& packed);
  std::shared_ptr<const PackedImage> ReadBack(const Slot& slot) const;

  const Make make_;
  const size_t memory_bytes_;
  const std::filesystem::path folder_;
  int file_ = -1;
  std::atomic<bool> file_full_ = false;
  std::atomic<size_t> memory_used_ = 0;
  std::atomic<int64_t> file_end_ = 0;
  std::atomic<int64_t> made_ = 0;
  std::vector<Slot> slots_;
};

}  // namespace likeness
