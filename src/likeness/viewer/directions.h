// The main directions in which an avatar's face changes: what sliders move.

#pragma once

#include <span>
#include <string>
#include <vector>

#include "likeness/avatar/avatar.h"

namespace likeness {

struct CodeDirection {
  std::vector<float> step;  // [latent], one standard deviation of the training codes
  double movement_mm = 0;   // root mean square distance by which a step moves the vertices, near the mean code
  // Training frames whose faces lie the most that way from the mean: "SEGMENT/FRAME".
  std::string minus, plus;
};

// Principal components of the codes (as many as they span), ordered by how far they move the face.
//   codes     of one person's frames; fewer than two, or all equal: no directions
//   mean      [latent], of these codes
//   jacobian  [3 x vertices, latent], mm for each unit of each of the code's values, at `mean`
std::vector<CodeDirection> FindDirections(const std::vector<const FrameCode*>& codes, std::span<const float> mean,
                                          std::span<const float> jacobian);

}  // namespace likeness
