// Maps a disc of polygons onto a rectangle without overlap, with as many texels for each region as it deserves.

#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace likeness {

struct Disc {
  std::vector<Eigen::Vector3f> positions;  // one a vertex
  std::vector<std::vector<int>> faces;     // polygons; every interior edge belongs to two
  // Texels a millimetre that each face should get, relative to the others; 0 for faces that only close a hole.
  std::vector<float> density;
  // Where border vertices lie; the border must be convex (sides of a rectangle are).
  std::vector<std::pair<int, Eigen::Vector2f>> border;
};

// Returns one point a vertex: the best of at most `rounds` rounds. Interior vertices are weighted means of their
// neighbours with positive weights, so that all faces are convex and none overlap (Tutte 1963); the weights are adapted
// so that stretch evens out (Yoshizawa, Belyaev, Seidel 2004, "A fast and simple stretch-minimizing mesh
// parameterization", here with a wanted density).
std::vector<Eigen::Vector2f> MapDiscToRectangle(const Disc& disc, int rounds);

}  // namespace likeness
