#include "likeness/simulate/glb/own_atlas.h"

#include <Eigen/Geometry>
#include <cmath>
#include <map>

namespace likeness {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

double SignedArea(const Vector2f& a, const Vector2f& b, const Vector2f& c) {
  const Eigen::Vector2d p = (b - a).cast<double>(), q = (c - a).cast<double>();
  return (p.x() * q.y() - p.y() * q.x()) / 2;
}

}  // namespace

std::optional<OwnCoordinates> OwnAtlas(const ClosedSurface& surface, const Vertices& rest, const HeadModel& model) {
  OwnCoordinates own;
  std::map<int, int> uv_of_vertex;           // of tracked vertices on borders
  std::map<std::pair<int, int>, int> index;  // (model surface, its uv)
  int material = -2;
  for (size_t t = 0; t < surface.sources.size(); ++t) {
    const auto& [s, triangle] = surface.sources[t];
    if (s < 0) return std::nullopt;
    const ModelSurface& source = model.surfaces[s];
    if (material == -2) material = source.material;
    if (material != source.material) return std::nullopt;
    Eigen::Vector3i corners;
    for (int k = 0; k < 3; ++k) {
      const int uv = source.triangle_uvs[triangle][k];
      const auto [it, added] = index.try_emplace({s, uv}, static_cast<int>(own.uvs.size()));
      if (added) {
        own.uvs.push_back(source.uvs[uv]);
        if (source.uvs[uv].minCoeff() < 0 || source.uvs[uv].maxCoeff() > 1) return std::nullopt;
      }
      corners[k] = it->second;
      uv_of_vertex[surface.triangles[t][k]] = it->second;
    }
    own.triangle_uvs.push_back(corners);
  }
  // Vertices of patches.
  const auto add_vertex = [&](int v, const Vector2f& uv) {
    uv_of_vertex[v] = static_cast<int>(own.uvs.size());
    own.uvs.push_back(uv);
  };
  for (const LidPatch& lid : surface.lids) {
    const auto at = [&](const BorderPoint& p) -> Vector2f {
      return own.uvs[uv_of_vertex.at(p.a)] + p.t * (own.uvs[uv_of_vertex.at(p.b)] - own.uvs[uv_of_vertex.at(p.a)]);
    };
    for (size_t c = 0; c < lid.top.size(); ++c) {
      const Vector2f upper = at(lid.top[c]), lower = at(lid.bottom[c]);
      for (int r = 1; r < kLidRows; ++r) {
        add_vertex(lid.first + static_cast<int>(c) * (kLidRows - 1) + r - 1,
                   upper + (lower - upper) * (static_cast<float>(r) / kLidRows));
      }
    }
  }
  for (const HolePatch& hole : surface.holes) {
    Vector2f sum = Vector2f::Zero();
    for (const int v : hole.border) sum += own.uvs[uv_of_vertex.at(v)];
    add_vertex(hole.middle, sum / static_cast<float>(hole.border.size()));
  }
  for (size_t t = surface.sources.size(); t < surface.triangles.size(); ++t) {
    const Eigen::Vector3i& v = surface.triangles[t];
    own.triangle_uvs.emplace_back(uv_of_vertex.at(v[0]), uv_of_vertex.at(v[1]), uv_of_vertex.at(v[2]));
  }

  double area = 0, patch_area = 0, size = 0, patch_size = 0;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    const Eigen::Vector3i& u = own.triangle_uvs[t];
    const Eigen::Vector3i& v = surface.triangles[t];
    const double texels = std::abs(SignedArea(own.uvs[u[0]], own.uvs[u[1]], own.uvs[u[2]]));
    const Vector3f a = rest.row(v[0]), b = rest.row(v[1]), c = rest.row(v[2]);
    const double mm2 = (b - a).cross(c - a).norm() / 2;
    const bool patch = surface.regions[t] == Region::kPatch;
    (patch ? patch_area : area) += texels;
    (patch ? patch_size : size) += mm2;
  }
  constexpr int kSize = 1024;
  const TexelMap map = MapTexels({surface.vertex_count, own.uvs, surface.triangles, own.triangle_uvs}, kSize);
  double covered = 0;
  for (const TexelMap::Texel& texel : map.texels) covered += texel.triangle >= 0 ? 1.0 / (kSize * kSize) : 0;
  constexpr double kOverlap = 1.01;  // what rounding to texels may feign
  if (area + patch_area > kOverlap * covered || area == 0) return std::nullopt;
  if (patch_size > 0 && patch_area / patch_size < 0.5 * area / size) return std::nullopt;
  own.fill = static_cast<float>(covered);
  return own;
}

}  // namespace likeness
