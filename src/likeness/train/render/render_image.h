// The rendering layer of the image loss (Lombardi et al. 2018, "Image-based vs. Texture/Geometry-based Loss"):
//
//   vertices, cameras ──> rasterise (no gradient) ──> triangle indices ─┐
//   vertices, cameras, texture coordinates ─────────────────────────────┴> texel coordinates ──> texture sample ──>
//   image
//
// Semi-differentiable: gradients reach textures, vertices and texture coordinates by what a triangle shows inside its
// outline. That the outline moves has no gradient, as in the paper; silhouettes.h adds one.

#pragma once

#include <torch/types.h>

#include "likeness/render/rasterizer.h"
#include "likeness/train/render/topology.h"

namespace likeness {

struct RenderOptions {
  RasterOptions raster;
  bool mip_maps = false;     // sample between levels of the texture; slower, in plain operations
  bool silhouettes = false;  // smooth outlines, with gradients; see silhouettes.h
  bool fused = true;         // one operation where there is one: on the CPU, without mip maps
};

struct RenderedImages {
  torch::Tensor colour;    // [N, 3, H, W] in the texture's units; 0 where nothing is seen
  torch::Tensor triangle;  // [N, H, W] int32; -1: nothing
};

// N images, or crops of images, of N meshes with N textures. The cameras are pinholes, as images of distorted lenses
// are resampled when they are read (capture/capture.h); the head pose is part of the projection.
//   texture      [N, 3, h, w] f32 or f64
//   vertices     [N, V, 3] mm, of the same type
//   projections  [N, 3, 4] f64; see rasterise.h, and ProjectionOf for crops
RenderedImages RenderImages(const torch::Tensor& texture, const torch::Tensor& vertices, const RenderTopology& topology,
                            const torch::Tensor& projections, int height, int width, const RenderOptions& options = {});

}  // namespace likeness
