#include "likeness/train/image_cache.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "likeness/base/error.h"
#include "likeness/base/log.h"

namespace likeness {
namespace {

size_t BitBytes(size_t texels) { return (texels + 7) / 8; }

// A file without a name.
int OpenScratch(const std::filesystem::path& folder) {
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  if (code) throw FileError(folder, "cannot make this folder: " + code.message());
  std::string path = (folder / ".images.XXXXXX").string();
  const int descriptor = mkostemp(path.data(), O_CLOEXEC);
  if (descriptor < 0) throw FileError(folder, fmt::format("cannot hold the cache: {}", std::strerror(errno)));
  unlink(path.c_str());
  return descriptor;
}

}  // namespace

PackedImage::PackedImage(const ImageU8& image, const ImageU8& counts) {
  LIKENESS_CHECK(image.channels() == 3 && (counts.empty() || counts.values().size() * 3 == image.values().size()));
  const size_t pixels = image.values().size() / 3;
  const uint8_t* pixel = image.values().data();
  const auto does_count = [&](size_t i) {
    return counts.empty() ? (pixel[3 * i] | pixel[3 * i + 1] | pixel[3 * i + 2]) != 0 : counts.values()[i] != 0;
  };
  size_t count = 0;
  for (size_t i = 0; i < pixels; ++i) count += does_count(i) ? 1 : 0;
  bytes_.resize(BitBytes(pixels) + 3 * count);
  uint8_t* colour = bytes_.data() + BitBytes(pixels);
  for (size_t i = 0; i < pixels; ++i) {
    if (!does_count(i)) continue;
    bytes_[i / 8] = static_cast<uint8_t>(bytes_[i / 8] | 1 << i % 8);
    colour = std::copy_n(pixel + 3 * i, 3, colour);
  }
}

void PackedImage::Unpack(int width, int height, ImageU8* image, ImageU8* counts) const {
  *image = ImageU8(width, height, 3);
  *counts = ImageU8(width, height, 1);
  const size_t pixels = counts->values().size();
  LIKENESS_CHECK(bytes_.size() >= BitBytes(pixels));
  const uint8_t* colour = bytes_.data() + BitBytes(pixels);
  uint8_t* pixel = image->values().data();
  uint8_t* mark = counts->values().data();
  for (size_t begin = 0; begin < pixels; begin += 8) {
    const uint8_t bits = bytes_[begin / 8];
    if (bits == 0) continue;
    if (bits == 0xff) {
      std::memset(mark + begin, 255, 8);
      std::memcpy(pixel + 3 * begin, colour, 24);
      colour += 24;
      continue;
    }
    for (size_t i = begin; i < std::min(begin + 8, pixels); ++i) {
      if ((bits >> (i - begin) & 1) == 0) continue;
      mark[i] = 255;
      std::memcpy(pixel + 3 * i, colour, 3);
      colour += 3;
    }
  }
  LIKENESS_CHECK(colour == bytes_.data() + bytes_.size());
}

ImageCache::ImageCache(int count, Make make, size_t memory_bytes, const std::filesystem::path& folder)
    : make_(std::move(make)),
      memory_bytes_(memory_bytes),
      folder_(folder),
      file_(folder.empty() ? -1 : OpenScratch(folder)),
      slots_(static_cast<size_t>(count)) {}

ImageCache::~ImageCache() {
  if (file_ >= 0) close(file_);
}

std::shared_ptr<const PackedImage> ImageCache::Get(int index) {
  Slot& slot = slots_[static_cast<size_t>(index)];
  std::shared_ptr<const PackedImage> made;
  std::call_once(slot.once, [&] {
    made = MakeOne(index);
    if (KeepInMemory(made->bytes().size())) {
      slot.packed = made;
    } else {
      KeepInFile(&slot, *made);
    }
  });
  if (made) return made;
  if (slot.packed) return slot.packed;
  return slot.offset >= 0 ? ReadBack(slot) : MakeOne(index);
}

std::shared_ptr<const PackedImage> ImageCache::MakeOne(int index) {
  ++made_;
  return std::make_shared<const PackedImage>(make_(index));
}

bool ImageCache::KeepInMemory(size_t size) {
  size_t used = memory_used_;
  do {
    if (size > memory_bytes_ - used) return false;
  } while (!memory_used_.compare_exchange_weak(used, used + size));
  return true;
}

bool ImageCache::KeepInFile(Slot* slot, const PackedImage& packed) {
  if (file_ < 0 || file_full_) return false;
  const std::vector<uint8_t>& bytes = packed.bytes();
  const int64_t offset = file_end_.fetch_add(static_cast<int64_t>(bytes.size()));
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t now = pwrite(file_, bytes.data() + done, bytes.size() - done, offset + static_cast<int64_t>(done));
    if (now < 0 && errno == EINTR) continue;
    if (now <= 0) {
      const int reason = errno;
      if (!file_full_.exchange(true)) {
        LogWarning("{}: the cache cannot grow: {}; further images are read from the capture each time",
                   folder_.string(), std::strerror(reason));
      }
      return false;
    }
    done += static_cast<size_t>(now);
  }
  slot->offset = offset;
  slot->size = bytes.size();
  return true;
}

std::shared_ptr<const PackedImage> ImageCache::ReadBack(const Slot& slot) const {
  auto packed = std::make_shared<PackedImage>();
  packed->bytes().resize(slot.size);
  for (size_t done = 0; done < slot.size;) {
    const ssize_t now =
        pread(file_, packed->bytes().data() + done, slot.size - done, slot.offset + static_cast<int64_t>(done));
    if (now < 0 && errno == EINTR) continue;
    if (now <= 0) throw FileError(folder_, fmt::format("the cache cannot be read back: {}", std::strerror(errno)));
    done += static_cast<size_t>(now);
  }
  return packed;
}

}  // namespace likeness
