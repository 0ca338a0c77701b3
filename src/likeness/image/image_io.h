// PNG, JPEG, AVIF and WebP files.

#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "likeness/image/image.h"

namespace likeness {

struct ImageInfo {
  int width = 0;
  int height = 0;
  int channels = 0;  // as stored: 1 grey, 2 grey + alpha, 3 RGB or palette, 4 RGBA
};

// Reads the header only. Throws Error when the file is no PNG, JPEG, AVIF or WebP.
ImageInfo ReadImageInfo(const std::filesystem::path& path);
ImageInfo ReadImageInfo(const std::filesystem::path& path_for_errors, std::string_view bytes);

// Whether a file begins and ends as a PNG does; false when it is absent. What an interrupted copy or a crash of the
// machine leaves behind does not, and nothing is decoded to know it.
bool LooksWholePng(const std::filesystem::path& path);

// Reads an 8-bit image (16-bit ones are reduced) with `channels` 1 (luma for colour files), 3 or 4 channels whatever
// the file stores. The format is told by the content, not by the name. Throws Error, naming the file, for anything
// that is not a whole PNG, JPEG, AVIF or WebP, and before memory is allocated for sizes over 32,768 x 32,768.
ImageU8 ReadImage(const std::filesystem::path& path, int channels = 3);
// The same of a file in memory.
ImageU8 DecodeImage(const std::filesystem::path& path_for_errors, std::string_view bytes, int channels = 3);

// Writes 1, 3 or 4 channels. `compression` is 0 to 9, as zlib's; 1 is the quickest to write and to read.
void WritePng(const std::filesystem::path& path, const ImageU8& image, int compression = 3);

// Writes 3 channels with 4:4:4 chroma.
void WriteJpeg(const std::filesystem::path& path, const ImageU8& image, int quality = 92);

// The same in memory, for pages that carry their pictures with them.
std::string EncodePng(const ImageU8& image, int compression = 3);
std::string EncodeJpeg(const ImageU8& image, int quality = 92);

}  // namespace likeness
