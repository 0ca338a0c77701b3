#include "likeness/simulate/gaze.h"

#include <Eigen/Geometry>
#include <numbers>

namespace likeness {

Eigen::Matrix3f GazeRotation(Side side, std::span<const float, kExpressionCount> weights) {
  struct Indices {
    int in, out, up, down;
  };
  static const Indices kIndices[2] = {{ExpressionIndex("eyeLookInLeft"), ExpressionIndex("eyeLookOutLeft"),
                                       ExpressionIndex("eyeLookUpLeft"), ExpressionIndex("eyeLookDownLeft")},
                                      {ExpressionIndex("eyeLookInRight"), ExpressionIndex("eyeLookOutRight"),
                                       ExpressionIndex("eyeLookUpRight"), ExpressionIndex("eyeLookDownRight")}};
  const Indices& i = kIndices[side];
  constexpr float kPi = std::numbers::pi_v<float>;
  constexpr float kSideways = 30 * kPi / 180, kUp = 25 * kPi / 180, kDown = 30 * kPi / 180;
  const float outwards = kSideways * (weights[i.out] - weights[i.in]);
  const float yaw = side == kLeft ? outwards : -outwards;  // towards the subject's left
  const float pitch = kUp * weights[i.up] - kDown * weights[i.down];
  return (Eigen::AngleAxisf(yaw, Eigen::Vector3f::UnitY()) * Eigen::AngleAxisf(-pitch, Eigen::Vector3f::UnitX()))
      .toRotationMatrix();
}

}  // namespace likeness
