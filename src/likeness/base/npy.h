// NumPy's .npy files of real numbers.

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace likeness {

struct NpyArray {
  std::vector<int64_t> shape;  // empty for a single number
  std::vector<double> values;  // the last index runs fastest
};

// Versions 1 to 3, float32 and float64 of either byte order, rows or columns first. Throws Error for other types and
// where the file is shorter or longer than its shape says.
NpyArray ParseNpy(const std::filesystem::path& path_for_errors, std::string_view bytes);

// Version 1, little-endian float32 with the last index running fastest.
std::string EncodeNpy(const std::vector<int64_t>& shape, const std::vector<float>& values);

}  // namespace likeness
