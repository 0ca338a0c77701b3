// PNG in memory. Common files (8 bits a channel, not interlaced, no palette) are inflated by libdeflate and unfiltered
// here, which takes less than half of libpng's time; image_io.cc hands the others to libpng.

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "likeness/image/image.h"

namespace likeness {

// The file's own words, unchecked but for the checksum of the chunk that holds them.
struct PngHeader {
  uint32_t width = 0, height = 0;
  int bit_depth = 0;
  int colour_type = 0;  // 0 grey, 2 RGB, 3 palette, 4 grey + alpha, 6 RGBA
  bool interlaced = false;
};

bool IsPng(std::string_view bytes);

// From the first 33 bytes of a file. Throws Error when they are no PNG's.
PngHeader ReadPngHeader(const std::filesystem::path& path_for_errors, std::string_view bytes);

// Decodes to `channels` 1, 3 or 4. None when the file is not of a common kind or needs a conversion: of gamma, from
// colour to grey, or to blend transparency away. Throws Error for damaged files. `bytes` are a whole file whose header
// was read, with sides that the caller accepts.
std::optional<ImageU8> DecodeCommonPng(const std::filesystem::path& path_for_errors, std::string_view bytes,
                                       int channels);

}  // namespace likeness
