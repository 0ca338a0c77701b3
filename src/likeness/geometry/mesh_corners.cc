#include "likeness/geometry/mesh_corners.h"

#include <map>
#include <utility>

namespace likeness {

MeshCorners CornersOf(const MeshTopology& topology) {
  MeshCorners corners;
  std::map<std::pair<int, int>, uint32_t> known;
  for (size_t t = 0; t < topology.triangles.size(); ++t) {
    for (int c = 0; c < 3; ++c) {
      const std::pair<int, int> corner = {topology.triangles[t][c], topology.triangle_uvs[t][c]};
      const auto [found, is_new] = known.emplace(corner, static_cast<uint32_t>(corners.vertices.size()));
      if (is_new) {
        corners.vertices.push_back(corner.first);
        corners.uvs.push_back(corner.second);
      }
      corners.indices.push_back(found->second);
    }
  }
  return corners;
}

}  // namespace likeness
