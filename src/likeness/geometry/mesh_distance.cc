#include "likeness/geometry/mesh_distance.h"

#include <algorithm>

namespace likeness {

std::vector<int> VerticesInTriangles(const MeshTopology& topology) {
  std::vector<int> used;
  for (const Eigen::Vector3i& triangle : topology.triangles) used.insert(used.end(), triangle.begin(), triangle.end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  return used;
}

double MeanDistance(const Vertices& a, const Vertices& b, const std::vector<int>& vertices) {
  double sum = 0;
  for (const int i : vertices) sum += (a.row(i) - b.row(i)).cast<double>().norm();
  return sum / static_cast<double>(vertices.size());
}

}  // namespace likeness
