// AVIF in memory, by libavif: still pictures of 8 to 12 bits, as published captures hold them.

#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "likeness/image/image_io.h"

namespace likeness {

bool IsAvif(std::string_view bytes);

// Size and channels as the container says; decodes nothing. Throws Error for what is no readable AVIF or has more than
// 64 Mpixel: a few bytes can stand for any number of pixels of one colour, so the file's length bounds nothing.
ImageInfo ReadAvifInfo(const std::filesystem::path& path_for_errors, std::string_view bytes);

// Decodes to 1 (luma), 3 or 4 channels of 8 bits, on the calling thread alone; the first picture of a sequence.
// Transparent pixels are laid over black when alpha is not asked for. Throws Error for damaged files and for pictures
// that the container turns or mirrors.
ImageU8 DecodeAvif(const std::filesystem::path& path_for_errors, std::string_view bytes, int channels);

// RGB to a still picture with 4:4:4 chroma. `quantizer` 0 (without loss) ... 63. Slow: for small files and tests.
std::string EncodeAvif(const ImageU8& rgb, int quantizer = 20);

}  // namespace likeness
