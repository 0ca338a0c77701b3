// Smoothing of triangle meshes that keeps their size.

#pragma once

#include <vector>

#include "likeness/geometry/mesh.h"

namespace likeness {

struct TaubinOptions {
  int iterations = 1000;    // of a shrinking and a growing step each
  double shrink = 0.5;      // lambda: share of the way to the neighbours' mean in a shrinking step
  double pass_band = 0.01;  // k_PB: frequencies below it stay; 2 is the highest that a mesh has

  void Check() const;  // throws Error
};

// Taubin 1995, "Curve and surface smoothing without shrinkage", with equal weights for all neighbours. A growing step
// goes mu = 1 / (k_PB - 1 / lambda) < 0 of the way, so that a frequency k is multiplied by
// ((1 - lambda k) (1 - mu k))^iterations: details smaller than about 13 edges vanish with the defaults. The pass band
// is narrower than the usual 0.1, with which a thousand iterations would nearly double what lies in the middle of it.
//
// Vertices on open borders follow their neighbours on the border alone; vertices without a triangle stay.
Vertices TaubinSmooth(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles,
                      const TaubinOptions& options = {});

}  // namespace likeness
