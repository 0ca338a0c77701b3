// Bilinear samples of textures, with gradients, in plain LibTorch operations.

#pragma once

#include <torch/types.h>

namespace likeness {

// The texture at every pixel. Texel centres lie at +0.5 texel, v = 1 is the first row, the border is repeated; a
// coordinate that is held at the border gets no gradient.
//   texture  [N, C, h, w]
//   uv       [N, H, W, 2]
//   returns  [N, C, H, W]
torch::Tensor SampleTextures(const torch::Tensor& texture, const torch::Tensor& uv);

// The same between levels of a pyramid in which each is the mean of 2 x 2 texels of the one before, so that a texture
// that is seen from afar does not flicker.
//   level    [N, H, W], 0: the texture itself, 1: at half its size; held between 0 and the last level of one texel
torch::Tensor SampleMipMaps(const torch::Tensor& texture, const torch::Tensor& uv, const torch::Tensor& level);

// The level at which a texel is about as large as a pixel: log2 of the longer of the two ways, in texels, to the next
// pixel at the right and below. Without gradient.
//   uv, uv_right, uv_below  [N, H, W, 2] of the same triangles
torch::Tensor MipLevel(const torch::Tensor& texture, const torch::Tensor& uv, const torch::Tensor& uv_right,
                       const torch::Tensor& uv_below);

}  // namespace likeness
