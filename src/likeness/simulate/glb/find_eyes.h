// Eyeballs and lids of a model.

#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "likeness/simulate/gaze.h"
#include "likeness/simulate/glb/gather.h"

namespace likeness {

struct ModelEye {
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();
  float radius = 12;
  bool has_ball = false;  // false: guessed from the lids
  bool has_gaze = false;  // the model has shapes that move the ball; it is not turned
};

// Where a model has no part that is an eye by its name: the pair of balls among its skin that is placed as eyes are
// becomes one, as surfaces of its own.
void FindUnnamedEyes(Gathered* all);

// Throws Error, naming the file, where there is neither a ball nor a shape that closes the lids.
std::array<ModelEye, 2> FindEyes(const std::filesystem::path& path_for_errors, const Gathered& all);

}  // namespace likeness
