#include "likeness/simulate/human/linear_shapes.h"

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"

namespace likeness {

LinearShapes::LinearShapes(const Stencil& stencil, const Vertices& coarse, const std::vector<Target>& shapes)
    : rest_(stencil * coarse) {
  LIKENESS_CHECK(shapes.size() == shapes_.size());
  ParallelFor(kExpressionCount, [&](int64_t k) {
    Vertices displacement = Vertices::Zero(coarse.rows(), 3);
    for (size_t i = 0; i < shapes[k].vertices.size(); ++i) {
      displacement.row(shapes[k].vertices[i]) += shapes[k].deltas[i].transpose();
    }
    const Vertices fine = stencil * displacement;
    for (Eigen::Index v = 0; v < fine.rows(); ++v) {
      if (fine.row(v).isZero(0)) continue;
      shapes_[k].vertices.push_back(static_cast<int>(v));
      shapes_[k].deltas.emplace_back(fine.row(v));
    }
  });
}

Vertices LinearShapes::Pose(std::span<const float, kExpressionCount> weights) const {
  Vertices posed = rest_;
  for (int k = 0; k < kExpressionCount; ++k) {
    if (weights[k] == 0) continue;
    const Target& shape = shapes_[k];
    for (size_t i = 0; i < shape.vertices.size(); ++i) {
      posed.row(shape.vertices[i]) += weights[k] * shape.deltas[i].transpose();
    }
  }
  return posed;
}

}  // namespace likeness
