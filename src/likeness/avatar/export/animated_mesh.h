// A performance's mesh as other programs animate meshes: one mesh at rest, a few targets that are added to it, and the
// weights of these over time.

#pragma once

#include <span>
#include <vector>

#include "likeness/avatar/arkit_fit.h"
#include "likeness/avatar/performance.h"
#include "likeness/geometry/mesh.h"

namespace likeness {

struct AnimatedMesh {
  MeshTopology topology;
  Vertices rest;                  // mm, head space
  std::vector<Vertices> targets;  // [K], mm; mesh = rest + sum of weight x target
  std::vector<double> seconds;    // [F]
  std::vector<float> weights;     // [F, K], -1 ... 1
  // [F], mm: poses relative to the first frame's, in which the head is upright.
  std::vector<RigidTransform> first_from_head;

  // Of all frames' vertices that belong to triangles, against the decoded meshes, mm.
  double mean_error_mm = 0;
  double largest_error_mm = 0;

  Vertices At(int frame) const;  // mm, head space
};

struct AnimateOptions {
  int most_targets = 32;
  double tolerance_mm = 0.05;  // no more targets than bring the root mean square of distances below this

  void Check() const;  // throws Error
};

// Targets are the principal directions of the meshes (of at most 200 of them, evenly spread over the performance).
AnimatedMesh Animate(const Performance& performance, const MeshDecoder& decode, const MeshTopology& topology,
                     const AnimateOptions& options = {});

}  // namespace likeness
