// Positions that are linear in the expression weights: rest + sum of weight x displacement, shape by shape.

#pragma once

#include <array>
#include <span>
#include <vector>

#include "likeness/simulate/head.h"
#include "likeness/simulate/human/subdivide.h"
#include "likeness/simulate/human/target.h"

namespace likeness {

class LinearShapes {
 public:
  LinearShapes() = default;
  //   stencil  [fine x coarse], applied to the coarse rest positions and to each of the 52 coarse shapes (mm)
  LinearShapes(const Stencil& stencil, const Vertices& coarse, const std::vector<Target>& shapes);

  const Vertices& rest() const { return rest_; }
  Vertices Pose(std::span<const float, kExpressionCount> weights) const;

 private:
  Vertices rest_;
  std::array<Target, kExpressionCount> shapes_;
};

}  // namespace likeness
