// Fits an ArkitMap to frames of which both coefficients and codes are known: ridge regression. Which terms (the
// coefficients alone, their squares, products with the jaw's opening) and how strong a ridge is decided by
// cross-validation over whole segments, in millimetres of the decoded mesh: what is predicted is a segment that the
// fit has not seen, as a recording will be.

#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "likeness/avatar/arkit_map.h"
#include "likeness/geometry/mesh.h"

namespace likeness {

struct ArkitFrame {
  std::string segment;
  std::vector<float> coefficients;  // [names], 0 ... 1
  std::vector<float> code;          // [latent], the encoder's
};

// The mesh of a code: vertices in head space, mm.
using MeshDecoder = std::function<Vertices(std::span<const float> code)>;

struct ArkitFitOptions {
  int folds = 5;          // parts that the segments are dealt into, each left out once; at most one a segment
  int most_scored = 200;  // frames whose meshes are compared, evenly spread over all

  void Check() const;  // throws Error
};

// One choice that was tried.
struct ArkitCandidate {
  std::string terms;    // "linear", "squares", "jaw products", "squares and jaw products"
  double strength = 0;  // of the ridge, where terms are scaled to deviation 1 and squared errors are averaged
  double error_mm = 0;  // mean distance to the mesh of the encoder's code, over frames of segments left out
};

struct ArkitFit {
  ArkitMap map;  // with the best candidate's choices, fitted to all frames
  ArkitCandidate best;
  std::vector<ArkitCandidate> candidates;  // all that were tried
};

//   names     of the coefficients
//   vertices  those whose distances count
// Throws Error where the frames are of fewer than two segments.
ArkitFit FitArkitMap(const std::vector<std::string>& names, const std::vector<ArkitFrame>& frames,
                     const MeshDecoder& decode, const std::vector<int>& vertices, const ArkitFitOptions& options = {});

}  // namespace likeness
