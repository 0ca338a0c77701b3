#include "likeness/simulate/gaze_condition.h"

#include <algorithm>

#include "likeness/simulate/gaze.h"

namespace likeness {

std::array<float, 6> GazeDirections(std::span<const float, kExpressionCount> weights) {
  std::array<float, 6> directions = {};
  for (const Side side : {kLeft, kRight}) {
    const Eigen::Vector3f direction = GazeRotation(side, weights) * Eigen::Vector3f::UnitZ();
    std::copy_n(direction.data(), 3, directions.begin() + 3 * side);
  }
  return directions;
}

}  // namespace likeness
