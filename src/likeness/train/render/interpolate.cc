#include "likeness/train/render/interpolate.h"

namespace likeness {
namespace {

// [N, P, 3, 2] or [N, P, 3, 3]: rows of `values` [N or 1, R, k] for the corners [N, P, 3].
torch::Tensor AtCorners(const torch::Tensor& values, const torch::Tensor& corners) {
  const int64_t n = corners.size(0), pixels = corners.size(1), width = values.size(2);
  const torch::Tensor index = corners.reshape({n, pixels * 3, 1}).expand({n, pixels * 3, width});
  return values.expand({n, values.size(1), width}).gather(1, index).reshape({n, pixels, 3, width});
}

}  // namespace

torch::Tensor TextureCoordinates(const torch::Tensor& triangle, const torch::Tensor& vertices,
                                 const RenderTopology& topology, const torch::Tensor& projections,
                                 std::array<double, 2> step) {
  const int64_t n = triangle.size(0), height = triangle.size(1), width = triangle.size(2);
  const torch::TensorOptions options = vertices.options().requires_grad(false);
  const torch::Tensor matrix = projections.to(options);
  const torch::Tensor homogeneous =
      vertices.matmul(matrix.narrow(2, 0, 3).transpose(1, 2)) + matrix.select(2, 3).unsqueeze(1);
  const torch::Tensor seen = triangle.clamp_min(0).reshape({n * height * width}).to(torch::kInt64);
  const torch::Tensor corners = topology.triangles.index_select(0, seen).reshape({n, height * width, 3});
  const torch::Tensor uv_corners = topology.triangle_uvs.index_select(0, seen).reshape({n, height * width, 3});

  const torch::Tensor x = (torch::arange(width, options) + (0.5 + step[0])).repeat({height}).reshape({1, -1, 1});
  const torch::Tensor y =
      (torch::arange(height, options) + (0.5 + step[1])).repeat_interleave(width).reshape({1, -1, 1});
  const torch::Tensor at = AtCorners(homogeneous, corners);
  const torch::Tensor px = at.select(3, 0) - x * at.select(3, 2), py = at.select(3, 1) - y * at.select(3, 2);
  const torch::Tensor next_x = px.roll(-1, 2), next_y = py.roll(-1, 2), last_x = px.roll(1, 2), last_y = py.roll(1, 2);
  const torch::Tensor areas = next_x * last_y - last_x * next_y;
  const torch::Tensor inside = torch::relu(areas * areas.detach().sum(2, true).sign());
  const torch::Tensor sum = inside.sum(2, true);
  // Outside of everything the first corner stands in.
  const torch::Tensor weights = torch::where(sum > 0, inside / sum.clamp_min(1e-30), torch::zeros_like(inside));
  const torch::Tensor uv = AtCorners(topology.uvs.unsqueeze(0), uv_corners);
  return (weights.unsqueeze(3) * uv).sum(2).reshape({n, height, width, 2});
}

}  // namespace likeness
