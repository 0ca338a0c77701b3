// Draws a lit head as one camera sees it.

#pragma once

#include <array>
#include <vector>

#include "likeness/geometry/camera.h"
#include "likeness/image/image.h"
#include "likeness/simulate/lit_head.h"
#include "likeness/simulate/material_maps.h"

namespace likeness {

enum class Shading {
  kFull,    // light, shadow, highlights
  kAlbedo,  // the albedo's sRGB values as they are; for exact tests
};

struct ShadingOptions {
  Shading shading = Shading::kFull;
  int samples = 4;  // rays a pixel, 1 to 64, in a fixed pattern (1: through the pixel's centre)

  void Check() const;  // throws Error
};

struct HeadPicture {
  ImageU8 rgb;              // sRGB-encoded, black where there is no head
  ImageU8 mask;             // 1 channel: 255 where the head covers at least half of the pixel, else 0
  int64_t camera_rays = 0;  // traced: the samples of all pixels in the head's bounding box
};

// Each sample of a pixel finds its surface, colour and relief; the lights are added up once for the samples that share
// a surface, with their mean relief. What can be prepared is prepared once for all frames. Pictures depend on nothing
// but the arguments: not on threads, not on earlier calls.
class HeadRenderer {
 public:
  // `head` is borrowed.
  HeadRenderer(const Head& head, const LightRig& rig, const ShadingOptions& options);

  const ShadingOptions& options() const { return options_; }

  // Uses all threads.
  LitHead Light(const PosedHead& posed, const RigidTransform& world_from_head) const;

  // Uses all threads, or only the caller's when called from within ParallelFor.
  HeadPicture Render(const LitHead& lit, const Camera& camera) const;

 private:
  struct Fragment;
  struct Lens;
  struct Scratch;
  struct PixelBox {
    int x0 = 0, x1 = 0, y0 = 0, y1 = 0;  // [x0, x1) x [y0, y1)
  };
  using CornerUvs = std::array<Eigen::Vector2f, 3>;

  static PixelBox BoundingBox(const LitHead& lit, const Camera& camera);
  void RenderBlock(const LitHead& lit, const Lens& lens, const PixelBox& block, Scratch* scratch,
                   HeadPicture* picture) const;
  Eigen::Vector2f TextureCoordinate(const RayHit& found) const;
  float Meet(const LitHead& lit, const Ray& ray, const RayHit& found, float open, float share,
             std::vector<Fragment>* fragments) const;
  Fragment MakeFragment(const LitHead& lit, const Ray& ray, const RayHit& found) const;
  Eigen::Vector3f Shade(const LitHead& lit, const Fragment& fragment) const;
  Eigen::Vector3f Resolve(const LitHead& lit, const std::vector<Fragment>& fragments) const;

  const Head& head_;
  LightTable lights_;
  // Of each surface:
  std::vector<MaterialMaps> maps_;
  std::vector<std::vector<CornerUvs>> corner_uvs_;  // of each triangle
  ShadingOptions options_;
};

}  // namespace likeness
