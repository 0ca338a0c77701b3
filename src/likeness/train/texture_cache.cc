#include "likeness/train/texture_cache.h"

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
  std::string path = (folder / ".textures.XXXXXX").string();
  const int descriptor = mkostemp(path.data(), O_CLOEXEC);
  if (descriptor < 0) throw FileError(folder, fmt::format("cannot hold the cache: {}", std::strerror(errno)));
  unlink(path.c_str());
  return descriptor;
}

}  // namespace

PackedTexture::PackedTexture(const ImageU8& texture, const ImageU8& seen) {
  LIKENESS_CHECK(texture.channels() == 3 && texture.width() == texture.height());
  LIKENESS_CHECK(seen.empty() || seen.values().size() * 3 == texture.values().size());
  const size_t texels = texture.values().size() / 3;
  const uint8_t* pixel = texture.values().data();
  const auto is_seen = [&](size_t i) {
    return seen.empty() ? (pixel[3 * i] | pixel[3 * i + 1] | pixel[3 * i + 2]) != 0 : seen.values()[i] != 0;
  };
  size_t count = 0;
  for (size_t i = 0; i < texels; ++i) count += is_seen(i) ? 1 : 0;
  bytes_.resize(BitBytes(texels) + 3 * count);
  uint8_t* colour = bytes_.data() + BitBytes(texels);
  for (size_t i = 0; i < texels; ++i) {
    if (!is_seen(i)) continue;
    bytes_[i / 8] = static_cast<uint8_t>(bytes_[i / 8] | 1 << i % 8);
    colour = std::copy_n(pixel + 3 * i, 3, colour);
  }
}

void PackedTexture::Unpack(int size, ImageU8* texture, ImageU8* seen) const {
  *texture = ImageU8(size, size, 3);
  *seen = ImageU8(size, size, 1);
  const size_t texels = seen->values().size();
  LIKENESS_CHECK(bytes_.size() >= BitBytes(texels));
  const uint8_t* colour = bytes_.data() + BitBytes(texels);
  uint8_t* pixel = texture->values().data();
  uint8_t* weight = seen->values().data();
  for (size_t begin = 0; begin < texels; begin += 8) {
    const uint8_t bits = bytes_[begin / 8];
    if (bits == 0) continue;
    if (bits == 0xff) {
      std::memset(weight + begin, 255, 8);
      std::memcpy(pixel + 3 * begin, colour, 24);
      colour += 24;
      continue;
    }
    for (size_t i = begin; i < std::min(begin + 8, texels); ++i) {
      if ((bits >> (i - begin) & 1) == 0) continue;
      weight[i] = 255;
      std::memcpy(pixel + 3 * i, colour, 3);
      colour += 3;
    }
  }
  LIKENESS_CHECK(colour == bytes_.data() + bytes_.size());
}

TextureCache::TextureCache(int count, Make make, size_t memory_bytes, const std::filesystem::path& folder)
    : make_(std::move(make)),
      memory_bytes_(memory_bytes),
      folder_(folder),
      file_(folder.empty() ? -1 : OpenScratch(folder)),
      slots_(static_cast<size_t>(count)) {}

TextureCache::~TextureCache() {
  if (file_ >= 0) close(file_);
}

std::shared_ptr<const PackedTexture> TextureCache::Get(int index) {
  Slot& slot = slots_[static_cast<size_t>(index)];
  std::shared_ptr<const PackedTexture> made;
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

std::shared_ptr<const PackedTexture> TextureCache::MakeOne(int index) {
  ++made_;
  return std::make_shared<const PackedTexture>(make_(index));
}

bool TextureCache::KeepInMemory(size_t size) {
  size_t used = memory_used_;
  do {
    if (size > memory_bytes_ - used) return false;
  } while (!memory_used_.compare_exchange_weak(used, used + size));
  return true;
}

bool TextureCache::KeepInFile(Slot* slot, const PackedTexture& packed) {
  if (file_ < 0 || file_full_) return false;
  const std::vector<uint8_t>& bytes = packed.bytes();
  const int64_t offset = file_end_.fetch_add(static_cast<int64_t>(bytes.size()));
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t now = pwrite(file_, bytes.data() + done, bytes.size() - done, offset + static_cast<int64_t>(done));
    if (now < 0 && errno == EINTR) continue;
    if (now <= 0) {
      const int reason = errno;
      if (!file_full_.exchange(true)) {
        LogWarning("{}: the cache cannot grow: {}; further textures are read from the capture each time",
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

std::shared_ptr<const PackedTexture> TextureCache::ReadBack(const Slot& slot) const {
  auto packed = std::make_shared<PackedTexture>();
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
