// The part of the image loss that has no gradient: which triangle each pixel shows.

#pragma once

#include <torch/types.h>

#include <vector>

#include "likeness/render/rasterizer.h"
#include "likeness/train/render/topology.h"

namespace likeness {

// The nearest triangle at every pixel centre of N images or crops, by render/rasterizer.h: exact top-left rule, cut at
// the near plane, back faces left out unless asked for.
//   vertices     [N, V, 3] mm; read on the CPU, as float32
//   projections  [N, 3, 4] f64, to homogeneous pixel coordinates of each crop; see Projections
//   returns      [N, height, width] int32 on the device of `vertices`; -1: nothing
// On all threads: an image each while there are enough of them, otherwise rows of one after the other.
torch::Tensor RasteriseTriangles(const torch::Tensor& vertices, const RenderTopology& topology,
                                 const torch::Tensor& projections, int height, int width,
                                 const RasterOptions& options = {});

// [N, 3, 4] f64 on the CPU.
torch::Tensor Projections(const std::vector<PixelFromMesh>& pixel_from_mesh);

}  // namespace likeness
