// The passes of a k4 s2 p1 layer over whole images, on row kernels and threads. See ops/convolution.h for what they
// are.

#pragma once

#include <ATen/Parallel.h>
#include <torch/types.h>

#include <cstdint>
#include <vector>

#include "likeness/train/ops/row_kernels.h"

namespace likeness {

// `samples` pairs of a large image [2 height, 2 width, large] and a small one [height, width, small], channels
// interleaved, and what is between them.
struct TextureLayer {
  const RowKernels& kernels;
  int samples, height, width;
  int large, small;  // channels; small a multiple of 16

  // weight  [small, large, 4, 4] float32
  // bias    [H', W', channels] of the output, or [channels]
  void Down(RowValues x, const float* weight, const float* bias, bool untied, float slope, void* y, bool bf16) const;
  void Up(RowValues x, const float* weight, const float* bias, bool untied, float slope, void* y, bool bf16) const;

  struct Gradients {
    void* x = nullptr;  // null: not wanted
    bool x_bf16 = false;
    float* weight = nullptr;  // [small, large, 4, 4]
    float* bias = nullptr;    // as the bias
  };
  // y, dy: the output and its gradient.
  void DownBackward(RowValues x, RowValues y, RowValues dy, const float* weight, bool untied, float slope,
                    const Gradients& to) const;
  void UpBackward(RowValues x, RowValues y, RowValues dy, const float* weight, bool untied, float slope,
                  const Gradients& to) const;
};

}  // namespace likeness
