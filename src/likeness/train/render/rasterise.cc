#include "likeness/train/render/rasterise.h"

#include <Eigen/Core>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"

namespace likeness {
namespace {

using RowMajorProjection = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

}  // namespace

torch::Tensor RasteriseTriangles(const torch::Tensor& vertices, const RenderTopology& topology,
                                 const torch::Tensor& projections, int height, int width,
                                 const RasterOptions& options) {
  const torch::NoGradGuard no_grad;
  const int64_t count = vertices.size(0), vertex_count = vertices.size(1);
  LIKENESS_CHECK(projections.sizes() == torch::IntArrayRef({count, 3, 4}) && height > 0 && width > 0);
  const torch::Tensor positions = vertices.detach().to(torch::kCPU, torch::kFloat32).contiguous();
  const torch::Tensor matrices = projections.to(torch::kCPU, torch::kFloat64).contiguous();
  const torch::Tensor corners = topology.triangles.cpu().contiguous();
  std::vector<Eigen::Vector3i> triangles(corners.size(0));
  const int64_t* corner = corners.const_data_ptr<int64_t>();
  for (Eigen::Vector3i& t : triangles) {
    for (int j = 0; j < 3; ++j) t[j] = static_cast<int>(*corner++);
  }
  const torch::Tensor indices = torch::empty({count, height, width}, torch::kInt32);
  const float* position = positions.const_data_ptr<float>();
  const double* matrix = matrices.const_data_ptr<double>();
  int32_t* index = indices.mutable_data_ptr<int32_t>();
  const auto draw = [&](int64_t i) {
    const Vertices mesh = Eigen::Map<const Vertices>(position + i * vertex_count * 3, vertex_count, 3);
    const PixelFromMesh projection = Eigen::Map<const RowMajorProjection>(matrix + i * 12);
    const FragmentImage image = Rasterize(mesh, triangles, projection, width, height, options);
    int32_t* out = index + i * height * width;
    for (const Fragment& fragment : image.fragments) *out++ = fragment.triangle;
  };
  if (count >= ThreadCount()) {
    ParallelFor(count, draw);
  } else {
    for (int64_t i = 0; i < count; ++i) draw(i);
  }
  return indices.to(vertices.device());
}

torch::Tensor Projections(const std::vector<PixelFromMesh>& pixel_from_mesh) {
  const torch::Tensor projections = torch::empty({static_cast<int64_t>(pixel_from_mesh.size()), 3, 4}, torch::kFloat64);
  double* out = projections.mutable_data_ptr<double>();
  for (const PixelFromMesh& matrix : pixel_from_mesh) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) *out++ = matrix(row, column);
    }
  }
  return projections;
}

}  // namespace likeness
