#include "likeness/geometry/mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "likeness/base/error.h"

namespace likeness {

void MeshTopology::Check(const std::string& what) const {
  if (triangles.size() != triangle_uvs.size()) {
    throw Error("{}: {} triangles but {} triangles with texture coordinates", what, triangles.size(),
                triangle_uvs.size());
  }
  const auto check = [&](const std::vector<Eigen::Vector3i>& indices, int count, const char* kind) {
    for (size_t i = 0; i < indices.size(); ++i) {
      if (indices[i].minCoeff() < 0 || indices[i].maxCoeff() >= count) {
        throw Error("{}: triangle {} refers to {} {}, but there are {}", what, i, kind,
                    indices[i].minCoeff() < 0 ? indices[i].minCoeff() : indices[i].maxCoeff(), count);
      }
    }
  };
  check(triangles, vertex_count, "vertex");
  check(triangle_uvs, static_cast<int>(uvs.size()), "texture coordinate");
  for (const Eigen::Vector2f& uv : uvs) {
    if (!uv.allFinite()) throw Error("{}: a texture coordinate is not a finite number", what);
  }
}

Vertices VertexNormals(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles) {
  Vertices normals = Vertices::Zero(vertices.rows(), 3);
  for (const Eigen::Vector3i& t : triangles) {
    const Eigen::RowVector3f edge1 = vertices.row(t[1]) - vertices.row(t[0]);
    const Eigen::RowVector3f edge2 = vertices.row(t[2]) - vertices.row(t[0]);
    const Eigen::RowVector3f normal = edge1.cross(edge2);
    for (int corner = 0; corner < 3; ++corner) normals.row(t[corner]) += normal;
  }
  for (Eigen::Index i = 0; i < normals.rows(); ++i) {
    const float length = normals.row(i).norm();
    if (length > 0) normals.row(i) /= length;
  }
  return normals;
}

TexelMap MapTexels(const MeshTopology& topology, int size) {
  TexelMap map;
  map.size = size;
  map.texels.resize(static_cast<size_t>(size) * size);
  for (size_t t = 0; t < topology.triangles.size(); ++t) {
    // In texels, y down.
    Eigen::Vector2d p[3];
    for (int corner = 0; corner < 3; ++corner) {
      const Eigen::Vector2f& uv = topology.uvs[topology.triangle_uvs[t][corner]];
      p[corner] = {double{uv.x()} * size, (1 - double{uv.y()}) * size};
    }
    const Eigen::Vector2d e1 = p[1] - p[0], e2 = p[2] - p[0];
    const double area = e1.x() * e2.y() - e1.y() * e2.x();
    if (area == 0) continue;
    const auto range = [&](int axis) {
      const double low = std::min({p[0][axis], p[1][axis], p[2][axis]});
      const double high = std::max({p[0][axis], p[1][axis], p[2][axis]});
      return std::pair(static_cast<int>(std::clamp(std::ceil(low - 0.5), 0.0, double(size))),
                       static_cast<int>(std::clamp(std::floor(high - 0.5), -1.0, size - 1.0)));
    };
    const auto [x0, x1] = range(0);
    const auto [y0, y1] = range(1);
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const Eigen::Vector2d d = Eigen::Vector2d(x + 0.5, y + 0.5) - p[0];
        const double b1 = (d.x() * e2.y() - d.y() * e2.x()) / area;
        const double b2 = (e1.x() * d.y() - e1.y() * d.x()) / area;
        if (b1 < 0 || b2 < 0 || b1 + b2 > 1) continue;
        TexelMap::Texel& texel = map.texels[static_cast<size_t>(y) * size + x];
        if (texel.triangle < 0) texel = {static_cast<int>(t), static_cast<float>(b1), static_cast<float>(b2)};
      }
    }
  }
  return map;
}

}  // namespace likeness
