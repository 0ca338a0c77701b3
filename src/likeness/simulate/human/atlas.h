// One texture atlas for skin and tracked mesh: two rectangles that fill it, above for face, scalp, ears and neck with
// the eye patches in their places, below for the inside of the mouth.

#pragma once

#include <array>
#include <vector>

#include "likeness/simulate/human/base_mesh.h"

namespace likeness {

// A closed loop of an even number of vertices, opened at its two corners of the eye (or mouth). Both rows run from the
// corner with the smaller x to the other and contain both corners.
struct SlitLoop {
  std::vector<int> upper;
  std::vector<int> lower;

  int segments() const { return static_cast<int>(upper.size()) - 1; }
};
SlitLoop OpenSlit(const std::vector<int>& loop, const Vertices& vertices);

// Rows of an eye patch at the level of the base mesh, including upper (0) and lower lid (the last).
inline constexpr int kPatchRows = 4;

struct HeadAtlas {
  std::vector<Eigen::Vector2f> uvs;  // at the level of the base mesh
  std::vector<Quad> face;            // indices into uvs, one entry a quad of BaseMesh::face
  std::vector<Quad> mouth;           // likewise of BaseMesh::mouth
  std::array<SlitLoop, 2> lids;      // by Side, base mesh vertices
  // Indices into uvs by [column][row]; column c stands between lids.upper[c] and lids.lower[c], row 0 is the upper lid,
  // row kPatchRows the lower one. In the first and last column all rows are the corner.
  std::array<std::vector<std::array<int, kPatchRows + 1>>, 2> patches;
};

// The same for every identity, as it depends on the base mesh alone. u grows to the subject's left over the face.
HeadAtlas BuildAtlas(const BaseMesh& base);

}  // namespace likeness
