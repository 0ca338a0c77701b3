#include "likeness/train/render/topology.h"

#include <map>

namespace likeness {
namespace {

torch::Tensor Indices(const std::vector<Eigen::Vector3i>& triangles, torch::Device device) {
  const torch::Tensor indices = torch::empty({static_cast<int64_t>(triangles.size()), 3}, torch::kInt64);
  int64_t* out = indices.mutable_data_ptr<int64_t>();
  for (const Eigen::Vector3i& t : triangles) {
    for (const int corner : t) *out++ = corner;
  }
  return indices.to(device);
}

std::vector<Eigen::Vector3i> Neighbours(const std::vector<Eigen::Vector3i>& triangles) {
  std::map<std::pair<int, int>, std::pair<int, int>> open;  // an edge's vertices -> triangle and corner
  std::vector<Eigen::Vector3i> neighbours(triangles.size(), Eigen::Vector3i::Constant(-1));
  for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
    for (int j = 0; j < 3; ++j) {
      const auto edge = std::minmax(triangles[t][j], triangles[t][(j + 1) % 3]);
      const auto [found, first] = open.try_emplace(edge, t, j);
      if (first) continue;
      neighbours[t][j] = found->second.first;
      neighbours[found->second.first][found->second.second] = t;
      open.erase(found);
    }
  }
  return neighbours;
}

}  // namespace

RenderTopology::RenderTopology(const MeshTopology& topology, torch::TensorOptions options)
    : triangles(Indices(topology.triangles, options.device())),
      triangle_uvs(Indices(topology.triangle_uvs, options.device())),
      neighbours(Indices(Neighbours(topology.triangles), options.device())),
      uvs(torch::empty({static_cast<int64_t>(topology.uvs.size()), 2})) {
  float* out = uvs.mutable_data_ptr<float>();
  for (const Eigen::Vector2f& uv : topology.uvs) {
    *out++ = uv.x();
    *out++ = uv.y();
  }
  uvs = uvs.to(options);
}

}  // namespace likeness
