// A mesh as graphics interfaces take it: one index for a vertex's position and its texture coordinate. A vertex on a
// seam of the texture stands once for each of its texture coordinates.

#pragma once

#include <cstdint>
#include <vector>

#include "likeness/geometry/mesh.h"

namespace likeness {

// In the order in which the triangles first name them.
struct MeshCorners {
  std::vector<int> vertices;      // of the mesh, one a corner
  std::vector<int> uvs;           // likewise
  std::vector<uint32_t> indices;  // three a triangle, into the two above
};
MeshCorners CornersOf(const MeshTopology& topology);

}  // namespace likeness
