// What `likeness bench decode` measures on the processor and on a GPU alike.

#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace likeness {

// Of 8-bit RGBA pixels whose opacity is equal; 100 where all are.
double PsnrDb(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b);

// Two eyes a metre away, half of 6.3 cm from the middle.
inline constexpr float kEyeX = 0.0316f;

// Times decoding on the GPU that EGL names first, one view, and two with the mesh; writes a table, or JSON.
void BenchDecodeOnGl(const std::filesystem::path& avatar_file, double seconds, bool json);

}  // namespace likeness
