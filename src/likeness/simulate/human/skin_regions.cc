#include "likeness/simulate/human/skin_regions.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "likeness/simulate/human/noise.h"

namespace likeness {
namespace {

using Eigen::Vector3f;

constexpr float kDegree = std::numbers::pi_v<float> / 180;

// 1 at the centre, 0 from `radius` on, for points of either side.
float Blob(const Vector3f& p, const Vector3f& centre, const Vector3f& radii) {
  const Vector3f d = (Vector3f(std::abs(p.x()), p.y(), p.z()) - centre).cwiseQuotient(radii);
  return SmoothStep(1, 0, d.norm());
}

}  // namespace

Eigen::Vector2f FrontalCoordinates(const Vector3f& p) { return {std::atan2(p.x(), p.z() + 80) * 100, p.y()}; }

float CheekWeight(const Vector3f& p) {
  return std::max(Blob(p, {42, -30, 8}, {30, 26, 40}), 0.5f * Blob(p, {0, -98, 22}, {22, 14, 20}));
}

float NoseTipWeight(const Vector3f& p) {
  return std::max(Blob(p, {0, -36, 42}, {15, 14, 22}), Blob(p, {15, -40, 26}, {10, 11, 16}));
}

float TZoneWeight(const Vector3f& p) {
  const float forehead = Blob(p, {0, 50, 22}, {52, 30, 50});
  const float nose = Blob(p, {0, -22, 36}, {16, 36, 30});
  const float chin = Blob(p, {0, -95, 24}, {20, 16, 24});
  return std::max({forehead, nose, chin});
}

float FaceWeight(const Vector3f& p) {
  return SmoothStep(-75, -40, p.z()) * SmoothStep(95, 75, p.y()) * SmoothStep(-125, -105, p.y());
}

float BeardWeight(const Vector3f& p) {
  const float x = std::abs(p.x());
  // The upper edge runs from below the nose to the sideburns, in front of the ears.
  const float edge = x < 26 ? -50 - 0.45f * std::max(0.0f, x - 4) : -59 + (x - 26) * 0.35f - 0.28f * (p.z() + 10);
  const float top = SmoothStep(edge + 5, edge - 6, p.y());
  const float front = SmoothStep(-72, -58, p.z());
  const float neck = SmoothStep(-142, -112, p.y() - 0.25f * p.z());
  return top * front * neck;
}

float UnderEyeWeight(const Vector3f& p) { return Blob(p, {29, -13, 15}, {19, 8, 26}); }

float ScalpWeight(const Vector3f& p, float hairline) {
  // Directions from the middle of the skull.
  const Vector3f d = (p - Vector3f(0, 22, -75)).normalized();
  const float azimuth = std::atan2(std::abs(d.x()), d.z()) / kDegree;  // 0 in front, 180 behind
  const float elevation = std::asin(std::clamp(d.y(), -1.0f, 1.0f)) / kDegree;
  // The lowest elevation with hair, by azimuth: forehead, temple, sideburn, round the ear, nape.
  struct Knot {
    float azimuth, low, receding;
  };
  constexpr Knot kKnots[] = {{0, 26, 40},     {20, 27, 47},    {34, 27, 50},    {46, 20, 37},
                             {58, 9, 19},     {68, -6, -2},    {80, -24, -20},  {98, -26, -24},
                             {108, -34, -34}, {120, -40, -40}, {140, -44, -44}, {180, -47, -47}};
  float edge = kKnots[0].low;
  for (size_t i = 1; i < std::size(kKnots); ++i) {
    const Knot &a = kKnots[i - 1], &b = kKnots[i];
    if (azimuth < a.azimuth || azimuth > b.azimuth) continue;
    const float t = SmoothStep(a.azimuth, b.azimuth, azimuth);
    edge = (1 - t) * (a.low + (a.receding - a.low) * hairline) + t * (b.low + (b.receding - b.low) * hairline);
  }
  edge += 2.5f * FractalNoise(p / 8, 2, 15);
  const Vector3f from_ear((std::abs(p.x()) - 83) / 11, (p.y() + 18) / 31, (p.z() + 73) / 22);
  return SmoothStep(edge - 3, edge + 6, elevation) * SmoothStep(1.0f, 1.35f, from_ear.norm());
}

float WrinkleHeight(const Vector3f& p) {
  const float x = std::abs(p.x());
  float depth = 0;
  if (p.y() < -35 || p.z() < -60) return 0;
  // Lines across the forehead, wavy and broken.
  const float waviness = 2.5f * GradientNoise(Vector3f(p.x() / 22, p.y() / 30, 3), 11) + 0.0012f * p.x() * p.x();
  const float across = SmoothStep(55, 25, x) * SmoothStep(28, 36, p.y()) * SmoothStep(78, 66, p.y());
  const float line = std::abs(std::remainder(p.y() + waviness, 11.0f));
  depth += 0.22f * across * SmoothStep(1.3f, 0, line) *
           SmoothStep(-0.4f, 0.3f, GradientNoise(Vector3f(p.x() / 16, p.y() / 9, 7), 12));
  // Crow's feet, fanning out from the outer corner of the eye.
  const Eigen::Vector2f from_corner(x - 44, p.y() + 2);
  const float angle = std::atan2(from_corner.y(), from_corner.x()) / kDegree;
  const float distance = from_corner.norm();
  const float fan = std::abs(std::remainder(angle + 5 * GradientNoise(Vector3f(x / 8, p.y() / 8, 1), 13), 17.0f));
  depth += 0.18f * SmoothStep(3, 6, distance) * SmoothStep(19, 9, distance) * SmoothStep(55, 40, std::abs(angle)) *
           SmoothStep(9.0f / std::max(distance, 1.0f) * 3, 0, fan);
  // Fine folds below the eye.
  const float below = std::abs(std::remainder(
      (Eigen::Vector2f(x - 30, p.y() * 1.3f - 4)).norm() + 1.5f * GradientNoise(Vector3f(x / 7, p.y() / 7, 2), 14),
      3.2f));
  depth += 0.07f * UnderEyeWeight(p) * SmoothStep(1, 0, below);
  return -depth;
}

}  // namespace likeness
