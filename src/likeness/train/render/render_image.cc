#include "likeness/train/render/render_image.h"

#include "likeness/train/render/rasterise.h"
#include "likeness/train/render/shade.h"
#include "likeness/train/render/silhouettes.h"

namespace likeness {

RenderedImages RenderImages(const torch::Tensor& texture, const torch::Tensor& vertices, const RenderTopology& topology,
                            const torch::Tensor& projections, int height, int width, const RenderOptions& options) {
  RenderedImages images;
  images.triangle = RasteriseTriangles(vertices, topology, projections, height, width, options.raster);
  const bool fused = options.fused && !options.mip_maps && texture.is_cpu();
  images.colour = fused ? ShadeFused(images.triangle, texture, vertices, topology, projections)
                        : ShadePlain(images.triangle, texture, vertices, topology, projections, options.mip_maps);
  if (options.silhouettes) {
    images.colour = BlendSilhouettes(images.colour, images.triangle, vertices, topology, projections);
  }
  return images;
}

}  // namespace likeness
