// Whatever is read as an image, told by its content: PNG, JPEG and the rest. Checksums of PNG chunks are put right
// first, as no mutation would get past them.

#include <libdeflate.h>

#include <algorithm>

#include "fuzz.h"
#include "likeness/image/avif.h"
#include "likeness/image/image_io.h"
#include "likeness/image/png.h"
#include "likeness/image/webp.h"

namespace likeness {
namespace {

uint32_t BigEndian(std::string_view bytes) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<uint8_t>(bytes[i]);
  return value;
}

std::string WithChecksums(std::string_view bytes) {
  std::string file(bytes);
  for (size_t begin = 8; begin + 12 <= file.size();) {
    const size_t length = BigEndian(bytes.substr(begin));
    if (length > file.size() - begin - 12) break;
    const uint32_t checksum = libdeflate_crc32(0, file.data() + begin + 4, length + 4);
    for (int i = 0; i < 4; ++i) file[begin + 8 + length + i] = static_cast<char>(checksum >> (24 - 8 * i) & 255);
    begin += length + 12;
  }
  return file;
}

}  // namespace

void fuzz::Run(std::string_view bytes) {
  const std::string file = IsPng(bytes) ? WithChecksums(bytes) : std::string(bytes);
  const auto info = Parsed([&] { return ReadImageInfo(kPath, file); });
  // A few bytes of AVIF or WebP may rightly stand for so many pixels that decoding them takes seconds.
  constexpr int kMostSide = 1024;
  if ((IsAvif(file) || IsWebp(file)) && info && std::max(info->width, info->height) > kMostSide) return;
  for (const int channels : {1, 3, 4}) {
    const auto image = Parsed([&] { return DecodeImage(kPath, file, channels); });
    if (!image) continue;
    LIKENESS_CHECK(info && image->width() == info->width && image->height() == info->height);
    LIKENESS_CHECK(image->channels() == channels);
    LIKENESS_CHECK(DecodeImage(kPath, EncodePng(*image, 1), channels) == *image);
  }
}

}  // namespace likeness
