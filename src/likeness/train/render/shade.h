// From triangle indices to pictures, with gradients to textures, vertices and texture coordinates, as one operation.

#pragma once

#include <torch/types.h>

#include "likeness/train/render/topology.h"

namespace likeness {

// colour = SampleTextures(texture, TextureCoordinates(triangle, vertices, ...)), 0 where there is no triangle.
//   triangle     [N, H, W] int32
//   texture      [N, 3, h, w]
//   vertices     [N, V, 3] mm
//   projections  [N, 3, 4] f64
//   returns      [N, 3, H, W]; with channels last from ShadeFused
//
// The plain one is made of LibTorch operations, runs on any device, and is what the other is tested against.
torch::Tensor ShadePlain(const torch::Tensor& triangle, const torch::Tensor& texture, const torch::Tensor& vertices,
                         const RenderTopology& topology, const torch::Tensor& projections, bool mip_maps = false);

// On the CPU, float32 or float64 throughout: one pass forwards, one backwards (shade_kernel.h has the derivation), an
// image a thread. Textures with channels last are read as they are, others are copied first.
torch::Tensor ShadeFused(const torch::Tensor& triangle, const torch::Tensor& texture, const torch::Tensor& vertices,
                         const RenderTopology& topology, const torch::Tensor& projections);

}  // namespace likeness
