// How decoding in lower precision is judged: by a few of the avatar's own codes, seen from the front and the sides.

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "likeness/decode/network.h"

namespace likeness {

// How something of lower precision compares with float32, over a few of the avatar's own mean codes.
struct KernelAccuracy {
  double psnr_db = 0;              // of the 8-bit textures; 100 where they are equal
  double largest_distance_mm = 0;  // between vertices

  bool Suffices() const;
};
inline constexpr double kLeastPsnrDb = 50;
inline constexpr double kMostDistanceMm = 0.02;

// A frame that is decoded for it.
struct SampleFrame {
  std::vector<float> code;
  std::array<float, 3> direction;  // of the view
};
// The mean code and a few of the file's codes, from in front and from four sides; fixed point measures its ranges by
// them.
std::vector<SampleFrame> SampleFrames(const DecoderNetwork& network);

// What was made of them, one after the other.
struct Sample {
  std::vector<uint8_t> pixels;  // RGBA
  std::vector<float> vertices;  // x y z
};

KernelAccuracy Compare(const Sample& sample, const Sample& truth);

}  // namespace likeness
