// Connectivity of triangles: borders and connected pieces.

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace likeness {

// Directed edges a -> b, each with the triangle that has it.
class EdgeMap {
 public:
  explicit EdgeMap(const std::vector<Eigen::Vector3i>& triangles);
  // The triangle on the left of the edge from a to b, -1 for none.
  int Left(int a, int b) const;

 private:
  std::unordered_map<uint64_t, int> left_;
};

// Leaves out what no surface has: triangles with two equal corners, and those that would be the second on one side of
// an edge. The others keep their order; returns the indices of those kept.
std::vector<int> ManifoldSubset(const std::vector<Eigen::Vector3i>& triangles);

// Borders as closed loops, each in the direction of its triangles' edges. Where a vertex has several borders (two fans
// that touch in it) loops are parted there, so that no loop has a vertex twice.
std::vector<std::vector<int>> BorderLoops(const std::vector<Eigen::Vector3i>& triangles);

// A number from 0 for each triangle; those with a common vertex have the same.
std::vector<int> ConnectedPieces(const std::vector<Eigen::Vector3i>& triangles, int vertex_count);

}  // namespace likeness
