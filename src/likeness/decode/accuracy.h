// How decoding in lower precision is judged: by a few of the avatar's own codes, seen from the front.

#pragma once

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

// What was made of SampleCodes, one after the other.
struct Sample {
  std::vector<uint8_t> pixels;  // RGBA
  std::vector<float> vertices;  // x y z
};

std::vector<std::vector<float>> SampleCodes(const DecoderNetwork& network);
inline constexpr float kSampleDirection[3] = {0, 0, 1};

KernelAccuracy Compare(const Sample& sample, const Sample& truth);

}  // namespace likeness
