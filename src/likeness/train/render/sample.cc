#include "likeness/train/render/sample.h"

#include <ATen/ops/avg_pool2d.h>
#include <ATen/ops/grid_sampler.h>

#include <algorithm>
#include <cmath>

namespace likeness {
namespace {

constexpr int64_t kBilinear = 0, kRepeatBorder = 1;  // as grid_sampler counts them

}  // namespace

torch::Tensor SampleTextures(const torch::Tensor& texture, const torch::Tensor& uv) {
  const torch::Tensor grid = torch::stack({2 * uv.select(3, 0) - 1, 1 - 2 * uv.select(3, 1)}, 3);
  return at::grid_sampler(texture, grid, kBilinear, kRepeatBorder, /*align_corners=*/false);
}

torch::Tensor SampleMipMaps(const torch::Tensor& texture, const torch::Tensor& uv, const torch::Tensor& level) {
  torch::Tensor map = texture, sum;
  for (int64_t i = 0;; ++i) {
    const bool last = std::min(map.size(2), map.size(3)) < 2;
    torch::Tensor near = level.clamp_min(0);
    if (last) near = near.clamp_max(static_cast<double>(i));
    const torch::Tensor weight = torch::relu(1 - (near - static_cast<double>(i)).abs()).unsqueeze(1);
    const torch::Tensor part = weight * SampleTextures(map, uv);
    sum = sum.defined() ? sum + part : part;
    if (last) return sum;
    map = at::avg_pool2d(map, {2, 2});
  }
}

torch::Tensor MipLevel(const torch::Tensor& texture, const torch::Tensor& uv, const torch::Tensor& uv_right,
                       const torch::Tensor& uv_below) {
  const torch::NoGradGuard no_grad;
  const torch::Tensor texels =
      torch::tensor({static_cast<double>(texture.size(3)), static_cast<double>(texture.size(2))}).to(uv.options());
  const torch::Tensor right = ((uv_right - uv) * texels).square().sum(3),
                      below = ((uv_below - uv) * texels).square().sum(3);
  return 0.5 * torch::log2(torch::maximum(right, below).clamp_min(1e-12));
}

}  // namespace likeness
