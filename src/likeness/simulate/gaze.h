// How eyes turn with the eyeLook weights; shared by all heads whose eyes have no shapes of their own for it.

#pragma once

#include <Eigen/Core>
#include <span>

#include "likeness/simulate/head.h"

namespace likeness {

enum Side { kLeft = 0, kRight = 1 };  // of the subject; left is +x

// The rotation of one eye for expression weights: 30 degrees outwards and inwards, 25 up, 30 down at weight 1.
Eigen::Matrix3f GazeRotation(Side side, std::span<const float, kExpressionCount> weights);

}  // namespace likeness
