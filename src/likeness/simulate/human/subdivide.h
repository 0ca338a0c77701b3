// Quad meshes and one step of Catmull-Clark subdivision as a linear map, so that shapes subdivide like the mesh.

#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <utility>
#include <vector>

namespace likeness {

using Quad = std::array<int, 4>;  // counter-clockwise; the last two are equal for a triangle in a UV fan
using Stencil = Eigen::SparseMatrix<float, Eigen::RowMajor>;

// Connectivity of one subdivision. The fine mesh keeps the coarse vertices under their indices, then come one vertex an
// edge and one a quad. Child `4 q + k` of quad q is (corner k, edge from k to k + 1, face point, edge from k - 1 to k).
struct Subdivision {
  int coarse_count = 0;
  int fine_count = 0;
  std::vector<std::pair<int, int>> edges;  // coarse ends (smaller first) of fine vertex coarse_count + i
  std::vector<int> edge_quads;             // how many quads share the edge
  std::vector<Quad> coarse_quads;
  std::vector<Quad> quads;  // four children a quad
};

Subdivision Subdivide(const std::vector<Quad>& quads, int vertex_count);

// A row of coarse vertices along edges, with the edges' own vertices between them.
std::vector<int> RefineRow(const std::vector<int>& row, const Subdivision& subdivision);

// Fine from coarse positions, [fine_count x coarse_count]: Catmull and Clark 1978, with cubic B-spline borders.
// Vertices without a quad keep their place.
Stencil CatmullClark(const Subdivision& subdivision);

// The same connectivity without smoothing (edge midpoints, quad centres): for texture coordinates.
std::vector<Eigen::Vector2f> SubdivideUvs(const Subdivision& subdivision, const std::vector<Eigen::Vector2f>& uvs);

}  // namespace likeness
