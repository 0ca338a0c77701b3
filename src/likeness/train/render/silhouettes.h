// Smooth outlines, whose gradient moves them: an option that the paper does not have.

#pragma once

#include <torch/types.h>

#include "likeness/train/render/topology.h"

namespace likeness {

// An edge is part of an outline when its triangle faces the camera and the one across faces away, or there is none.
// Where it passes between the centres of two neighbouring pixels, at a share s of the way from the one on the
// triangle's side, the surface covers the first s of what lies between them. A pixel reaches half of the way, so (after
// Laine et al. 2020, "Modular Primitives for High-Performance Differentiable Rendering", section 3.6)
//   s > 1/2:  the pixel beyond gets s - 1/2 of the surface's colour
//   s < 1/2:  the surface's pixel gets 1/2 - s of the one beyond
// s depends on the edge's vertices, with gradient. Neighbours are those at the right and below. An edge is seen when
// the pixel beyond shows nothing, or what is deeper than the edge; of several between two pixels the nearest one
// counts. Edges are gone through, and not the triangles that pixels show as in the paper: at an outline a fine mesh is
// seen so flat that few pixels show the triangle at its end.
//
// In LibTorch operations, on any device. Triangles that face away must not be drawn.
//   colour       [N, C, H, W], 0 where there is no triangle
//   triangle     [N, H, W] int32, as RasteriseTriangles gives it
//   vertices     [N, V, 3] mm
//   projections  [N, 3, 4] f64
//   returns      [N, C, H, W]
torch::Tensor BlendSilhouettes(const torch::Tensor& colour, const torch::Tensor& triangle,
                               const torch::Tensor& vertices, const RenderTopology& topology,
                               const torch::Tensor& projections);

}  // namespace likeness
