#include "likeness/train/render/topology.h"

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

}  // namespace

RenderTopology::RenderTopology(const MeshTopology& topology, torch::TensorOptions options)
    : triangles(Indices(topology.triangles, options.device())),
      triangle_uvs(Indices(topology.triangle_uvs, options.device())),
      uvs(torch::empty({static_cast<int64_t>(topology.uvs.size()), 2})) {
  float* out = uvs.mutable_data_ptr<float>();
  for (const Eigen::Vector2f& uv : topology.uvs) {
    *out++ = uv.x();
    *out++ = uv.y();
  }
  uvs = uvs.to(options);
}

}  // namespace likeness
