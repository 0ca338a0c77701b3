// Where the eyes of a simulated head look, as conditions/gaze.csv of its capture says (capture/condition_file.h).

#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "likeness/simulate/head.h"

namespace likeness {

inline const std::vector<std::string> kGazeColumns = {"left_x", "left_y", "left_z", "right_x", "right_y", "right_z"};

// Unit vectors in head space, of the subject's left eye, then of the right one, that the eyeLook weights ask for.
std::array<float, 6> GazeDirections(std::span<const float, kExpressionCount> weights);

}  // namespace likeness
