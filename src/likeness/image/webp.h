// WebP in memory, by libwebp: still pictures with or without alpha, as models hold their textures.

#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "likeness/image/image_io.h"

namespace likeness {

bool IsWebp(std::string_view bytes);

// Size and channels as the header says; decodes nothing. Throws Error for what is no readable WebP or has more than
// 64 Mpixel: a few bytes can stand for any number of pixels of one colour, so the file's length bounds nothing.
ImageInfo ReadWebpInfo(const std::filesystem::path& path_for_errors, std::string_view bytes);

// Decodes to 1 (luma), 3 or 4 channels. Alpha is dropped, not blended, when it is not asked for. Throws Error for
// damaged files and for animations.
ImageU8 DecodeWebp(const std::filesystem::path& path_for_errors, std::string_view bytes, int channels);

// 3 or 4 channels without loss.
std::string EncodeWebp(const ImageU8& image);

}  // namespace likeness
