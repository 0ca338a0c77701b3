// Textures of a capture as training keeps them: packed, in memory as far as a budget goes, then in a file.

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

// A square RGB texture: a bit a texel that says whether it is seen, then the colours of those that are. A face takes
// about half of its texture and a camera sees about half of the face: a quarter to a half of the bytes.
class PackedTexture {
 public:
  PackedTexture() = default;
  //   seen  S x S x 1, 0 where not; empty: where the texel is (0, 0, 0)
  PackedTexture(const ImageU8& texture, const ImageU8& seen);

  // `texture` is 0 where not seen; `seen` is 255 or 0.
  void Unpack(int size, ImageU8* texture, ImageU8* seen) const;

  std::vector<uint8_t>& bytes() { return bytes_; }
  const std::vector<uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<uint8_t> bytes_;
};

// Textures by number, each made when it is first asked for. Safe from several threads.
class TextureCache {
 public:
  using Make = std::function<PackedTexture(int)>;

  //   make          reads a texture from its source; may throw
  //   memory_bytes  for textures in memory at most
  //   folder        those beyond go to a file in there, which has no name and goes with this object or the process;
  //                 empty: they are made again. A disk that is full does the same.
  // Throws Error when the folder cannot be written to.
  TextureCache(int count, Make make, size_t memory_bytes, const std::filesystem::path& folder);
  ~TextureCache();
  TextureCache(const TextureCache&) = delete;
  TextureCache& operator=(const TextureCache&) = delete;

  std::shared_ptr<const PackedTexture> Get(int index);

  size_t memory_bytes() const { return memory_used_; }
  size_t file_bytes() const { return static_cast<size_t>(file_end_.load()); }
  int64_t made() const { return made_; }  // calls of `make`

 private:
  struct Slot {
    std::once_flag once;
    std::shared_ptr<const PackedTexture> packed;  // in memory
    int64_t offset = -1;                          // in the file
    size_t size = 0;
  };
  std::shared_ptr<const PackedTexture> MakeOne(int index);
  bool KeepInMemory(size_t size);
  bool KeepInFile(Slot* slot, const PackedTexture& packed);
  std::shared_ptr<const PackedTexture> ReadBack(const Slot& slot) const;

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
