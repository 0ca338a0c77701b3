// Texel coordinates of pixels from triangle indices, camera and vertices, with gradients, in plain LibTorch operations.

#pragma once

#include <torch/types.h>

#include "likeness/train/render/topology.h"

namespace likeness {

// Perspective-correct texture coordinates at every pixel centre (Lombardi et al. 2018, "Image-based vs. Texture/
// Geometry-based Loss", second step).
//   triangle     [N, H, W] int32, as RasteriseTriangles gives it
//   vertices     [N, V, 3] mm; gets gradients, as topology.uvs does
//   projections  [N, 3, 4] f64
//   step         pixels that the centres are moved by, {x, y}: the same triangles, seen beside themselves
//   returns      [N, H, W, 2]; what it is where there is no triangle means nothing and has no gradient
//
// With a corner's homogeneous pixel coordinates (X_i, Y_i, Z_i) let x_i = X_i - q_x Z_i and y_i = Y_i - q_y Z_i: the
// pixel centre q becomes the origin. The weights b_i are then in proportion to the areas
//   a_0 = x_1 y_2 - x_2 y_1, and so on around,
// which holds before the division by depth and hence for corners behind the camera too. Areas of the wrong sign count
// as 0, as in shade_kernel.h; there the derivative is written out, here it is autograd's.
torch::Tensor TextureCoordinates(const torch::Tensor& triangle, const torch::Tensor& vertices,
                                 const RenderTopology& topology, const torch::Tensor& projections,
                                 std::array<double, 2> step = {0, 0});

}  // namespace likeness
