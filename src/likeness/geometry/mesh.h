// Triangle meshes of fixed topology: connectivity and texture coordinates once, positions for every frame.

#pragma once

#include <Eigen/Core>
#include <vector>

namespace likeness {

// Positions, one a row, millimetres unless said otherwise. 3 x float32 a vertex without padding.
using Vertices = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;

// Connectivity. Texture coordinates have their own indices, as a vertex on a seam has several. u runs right and v runs
// up: v = 1 is the first row of a texture's image.
struct MeshTopology {
  int vertex_count = 0;                       // vertices may belong to no triangle
  std::vector<Eigen::Vector2f> uvs;           // usually in [0, 1]
  std::vector<Eigen::Vector3i> triangles;     // vertex indices, counter-clockwise seen from outside
  std::vector<Eigen::Vector3i> triangle_uvs;  // indices into uvs, one entry a triangle

  // Throws Error naming `what` when an index or a count is wrong.
  void Check(const std::string& what) const;
};

// Area-weighted unit normals a vertex; zero where no triangle touches it.
Vertices VertexNormals(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles);

// For every texel of a size x size texture: the triangle that covers its centre and where in it.
struct TexelMap {
  struct Texel {
    int triangle = -1;     // -1: no triangle covers this texel
    float b1 = 0, b2 = 0;  // barycentric weights of the triangle's second and third corner
  };
  int size = 0;
  std::vector<Texel> texels;  // row-major; row 0 is v = 1

  const Texel& at(int x, int y) const { return texels[static_cast<size_t>(y) * size + x]; }
};

// The texel at column x, row y has its centre at u = (x + 0.5) / size, v = 1 - (y + 0.5) / size. Where charts overlap
// the triangle with the lowest index wins.
TexelMap MapTexels(const MeshTopology& topology, int size);

}  // namespace likeness
