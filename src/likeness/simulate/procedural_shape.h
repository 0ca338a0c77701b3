// The form of the procedural head: where each point of its (s, t) grid goes for a set of weights.

#pragma once

#include <Eigen/Core>
#include <span>

#include "likeness/simulate/head.h"

namespace likeness {

// Rectangles of the grid, in s and t. Inside them lie a lid patch or the inside of the mouth.
struct GridRectangle {
  double s0, s1, t0, t1;

  // -1 ... 1 inside, beyond outside.
  double P(double s) const { return 2 * (s - s0) / (s1 - s0) - 1; }
  double Q(double t) const { return 2 * (t - t0) / (t1 - t0) - 1; }
};

// Multiples of 1/40 in s and of 1/36 in t, so that they lie on grid lines.
inline constexpr GridRectangle kLeftEyeRectangle = {23.0 / 40, 27.0 / 40, 19.0 / 36, 21.0 / 36};
inline constexpr GridRectangle kRightEyeRectangle = {13.0 / 40, 17.0 / 40, 19.0 / 36, 21.0 / 36};
inline constexpr GridRectangle kMouthRectangle = {17.0 / 40, 23.0 / 40, 8.0 / 36, 12.0 / 36};

inline constexpr double kEyeballRadiusMm = 12;

// The weights that the head understands, and what follows from them.
class ProceduralShape {
 public:
  explicit ProceduralShape(std::span<const float, kExpressionCount> weights);

  // Head space, mm. Twice continuously differentiable but at the rims of the three rectangles.
  Eigen::Vector3d Point(double s, double t) const;

  Eigen::Vector3d EyeCentre(bool left) const;
  // Turns an eyeball that looks along +z.
  Eigen::Matrix3d Gaze(bool left) const;
  // Moves a point that is fixed to the jaw: `share` 0 leaves it, 1 is the chin.
  Eigen::Vector3d MoveWithJaw(const Eigen::Vector3d& point, double share) const;
  // Where the lips meet at rest, at x = 0.
  Eigen::Vector3d LipCentre() const;

 private:
  Eigen::Vector3d EyePoint(bool left, double p, double q) const;
  Eigen::Vector3d MouthPoint(double p, double q) const;
  double Weight(const char* name) const;
  double Weight(const char* name, bool left) const;

  std::span<const float, kExpressionCount> weights_;
};

}  // namespace likeness
