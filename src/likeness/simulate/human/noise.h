// Solid noise: functions of a point in space, so that what is painted with them has no seams.

#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace likeness {

// Smooth gradient noise (Perlin 2002), about [-1, 1], features of size 1.
float GradientNoise(const Eigen::Vector3f& point, uint32_t seed);

// Octaves of it, each half as large and half as strong: about [-1, 1].
float FractalNoise(Eigen::Vector3f point, int octaves, uint32_t seed);

// The nearest of points scattered one in each unit cell (Worley 1996).
struct NearestSpot {
  float distance = 1e30f;
  uint32_t id = 0;  // random bits that belong to the spot
};
NearestSpot FindNearestSpot(const Eigen::Vector3f& point, uint32_t seed);

// Random bits, and a number in [0, 1), of a lattice cell.
uint32_t HashCell(int x, int y, int z, uint32_t seed);
inline float UnitFromBits(uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

// 0 below `low`, 1 above `high`, smooth between; falls instead when low > high.
float SmoothStep(float low, float high, float value);

}  // namespace likeness
