// How fast the image loss is on this machine: what `likeness bench render-loss` measures.

#pragma once

#include <cstdint>

namespace likeness {

struct RenderBenchOptions {
  int crops = 16;
  int crop = 512;      // pixels a side
  int texture = 1024;  // texels a side
  int runs = 5;        // measured, after one that warms up
  uint64_t seed = 0;

  void Check() const;  // throws Error naming the option
};

// Medians of the runs: by the clock, and the processor's time of all threads, which other programs disturb less.
struct RunTime {
  double wall_ms = 0, processor_ms = 0;
};

struct RenderBenchResult {
  int threads = 0;
  int64_t vertices = 0, triangles = 0;
  double covered = 0;  // share of the pixels that show the mesh
  // The indices, without gradient; the same for both.
  RunTime rasterise;
  // From indices to the mean squared error of the pixels that the mesh covers, and back to textures and vertices: as
  // one operation, and with LibTorch's own.
  RunTime forward, backward;
  RunTime plain_forward, plain_backward;
  // Of both, in float32, from the plain one's gradients in float64, for the first crop: |a - b| / |b|. With textures of
  // noise the derivative jumps at every texel, so that these count the coordinates that rounding moves across one.
  double gradient_error = 0, plain_gradient_error = 0;
};

// Random crops on a bumpy ball of the size of a head, seen by cameras like Multiface's: images of 1334 x 2048 pixels,
// a focal length of 7700 and 1.1 m away, all around its front. Both ways run in turn in every run.
RenderBenchResult BenchRenderLoss(const RenderBenchOptions& options);

}  // namespace likeness
