// Draws a lit head as one camera sees it.

#pragma once

#include <vector>

#include "likeness/geometry/camera.h"
#include "likeness/image/image.h"
#include "likeness/simulate/lit_head.h"

namespace likeness {

enum class Shading {
  kFull,    // light, shadow, highlights
  kAlbedo,  // the albedo's sRGB values as they are; for exact tests
};

struct RenderOptions {
  Shading shading = Shading::kFull;
  int samples = 4;  // rays a pixel, 1 to 64, in a fixed pattern (1: through the pixel's centre)

  void Check() const;  // throws Error
};

struct HeadPicture {
  ImageU8 rgb;   // sRGB-encoded, black where there is no head
  ImageU8 mask;  // 1 channel: 255 where the head covers at least half of the pixel, else 0
};

// What can be prepared once for all frames. Pictures depend on nothing but the arguments: not on threads, not on
// earlier calls.
class HeadRenderer {
 public:
  // `head` is borrowed.
  HeadRenderer(const Head& head, const LightRig& rig, const RenderOptions& options);

  const RenderOptions& options() const { return options_; }

  // Uses all threads.
  LitHead Light(const PosedHead& posed, const RigidTransform& world_from_head) const;

  // Uses all threads, or only the caller's when called from within ParallelFor.
  HeadPicture Render(const LitHead& lit, const Camera& camera) const;

 private:
  struct Sample;
  struct Hit;

  Sample Trace(const LitHead& lit, Ray ray) const;
  Eigen::Vector3f Shade(const LitHead& lit, const Hit& hit) const;

  const Head& head_;
  LightTable lights_;
  RenderOptions options_;
};

}  // namespace likeness
