#include "likeness/simulate/human/noise.h"

#include <algorithm>
#include <cmath>

namespace likeness {
namespace {

// Dot product with one of twelve directions to a cube's edges.
float Gradient(uint32_t hash, float x, float y, float z) {
  const uint32_t h = hash & 15;
  const float u = h < 8 ? x : y;
  const float v = h < 4 ? y : (h == 12 || h == 14 ? x : z);
  return ((h & 1) != 0 ? -u : u) + ((h & 2) != 0 ? -v : v);
}

float Fade(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }

float Lerp(float t, float a, float b) { return a + t * (b - a); }

}  // namespace

uint32_t HashCell(int x, int y, int z, uint32_t seed) {
  uint32_t h = seed + 0x9e3779b9u * static_cast<uint32_t>(x) + 0x85ebca6bu * static_cast<uint32_t>(y) +
               0xc2b2ae35u * static_cast<uint32_t>(z);
  h ^= h >> 16;
  h *= 0x7feb352du;
  h ^= h >> 15;
  h *= 0x846ca68bu;
  return h ^ (h >> 16);
}

float GradientNoise(const Eigen::Vector3f& p, uint32_t seed) {
  const float fx = std::floor(p.x()), fy = std::floor(p.y()), fz = std::floor(p.z());
  const int x = static_cast<int>(fx), y = static_cast<int>(fy), z = static_cast<int>(fz);
  const float dx = p.x() - fx, dy = p.y() - fy, dz = p.z() - fz;
  const float u = Fade(dx), v = Fade(dy), w = Fade(dz);
  const auto corner = [&](int i, int j, int k) {
    return Gradient(HashCell(x + i, y + j, z + k, seed), dx - static_cast<float>(i), dy - static_cast<float>(j),
                    dz - static_cast<float>(k));
  };
  return Lerp(w, Lerp(v, Lerp(u, corner(0, 0, 0), corner(1, 0, 0)), Lerp(u, corner(0, 1, 0), corner(1, 1, 0))),
              Lerp(v, Lerp(u, corner(0, 0, 1), corner(1, 0, 1)), Lerp(u, corner(0, 1, 1), corner(1, 1, 1))));
}

float FractalNoise(Eigen::Vector3f point, int octaves, uint32_t seed) {
  float sum = 0, strength = 1, total = 0;
  for (int i = 0; i < octaves; ++i) {
    sum += strength * GradientNoise(point, seed + static_cast<uint32_t>(i));
    total += strength;
    strength /= 2;
    point *= 2.03f;
  }
  return sum / total;
}

NearestSpot FindNearestSpot(const Eigen::Vector3f& p, uint32_t seed) {
  // Only the two nearest cells along each axis: a spot farther than half a cell may be missed, which no picture shows.
  const Eigen::Vector3f base = (p.array() - 0.5f).floor();
  const int x = static_cast<int>(base.x()), y = static_cast<int>(base.y()), z = static_cast<int>(base.z());
  NearestSpot best;
  for (int k = 0; k < 8; ++k) {
    const int cx = x + (k & 1), cy = y + (k >> 1 & 1), cz = z + (k >> 2);
    const uint32_t id = HashCell(cx, cy, cz, seed);
    const float dx = static_cast<float>(cx) + static_cast<float>(id & 1023) / 1023 - p.x();
    const float dy = static_cast<float>(cy) + static_cast<float>(id >> 10 & 1023) / 1023 - p.y();
    const float dz = static_cast<float>(cz) + static_cast<float>(id >> 20 & 1023) / 1023 - p.z();
    const float d2 = dx * dx + dy * dy + dz * dz;
    if (d2 < best.distance) best = {d2, id * 0x9e3779b9u};
  }
  best.distance = std::sqrt(best.distance);
  return best;
}

float SmoothStep(float low, float high, float value) {
  const float t = std::clamp((value - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

}  // namespace likeness
