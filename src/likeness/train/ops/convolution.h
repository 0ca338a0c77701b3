// A k4 s2 p1 convolution, or a transposed one, with bias and leaky ReLU, as one differentiable operation.

#pragma once

#include <torch/types.h>

#include "likeness/train/ops/row_kernels.h"

namespace likeness {

enum class ConvolutionKind { kDown, kUp };  // halves or doubles the side

// y = leaky_relu(a), a = convolution(x, weight) + bias.
//   x       [N, in, H, W]
//   weight  [out, in, 4, 4] for kDown, [in, out, 4, 4] for kUp
//   bias    [out], or [out, H', W'] of the output's size: one for every texel
//   slope   in (0, 1]; 1 is no activation
//   returns [N, out, H / 2, W / 2] or [N, out, 2 H, 2 W]
// With the large image X (2H x 2W, channels l), the small one x (H x W, channels s) and X, x zero outside:
//   kDown  x[s, m, n]  = sum over ky, kx, l of weight[s, l, ky, kx] X[l, 2m + ky - 1, 2n + kx - 1]
//   kUp    X[l, Y, Z]  = sum of the same weights times x[s, m, n] over all (m, ky), (n, kx) with
//                        2m + ky - 1 = Y, 2n + kx - 1 = Z
// Each is the other's transpose. With g = dy where y > 0, slope dy elsewhere (a and y have the same sign):
//   dx = kUp(g) for kDown, kDown(g) for kUp;  dbias = sum of g over N (and texels);
//   dweight[s, l, ky, kx] = sum over N, m, n of large[l, 2m + ky - 1, 2n + kx - 1] small[s, m, n],
//   large being x and small g for kDown, the other way round for kUp.
//
// On the CPU all of a direction is done in one pass over rows of texels, so that features and gradients are read once
// and written once: at high resolution training is bound by memory. Under PrecisionScope(kBfloat16), where the
// processor can, y is bfloat16 if an activation follows. Elsewhere - other devices, other types, images so small that
// their rows do not fill vectors - LibTorch's own operations.
torch::Tensor ConvolveAndActivate(ConvolutionKind kind, const torch::Tensor& x, const torch::Tensor& weight,
                                  const torch::Tensor& bias, double slope);

// For tests: with these kernels whatever the processor's best are, and with LibTorch's operations.
torch::Tensor ConvolveWith(const RowKernels& kernels, ConvolutionKind kind, const torch::Tensor& x,
                           const torch::Tensor& weight, const torch::Tensor& bias, double slope);
torch::Tensor ConvolvePlainly(ConvolutionKind kind, const torch::Tensor& x, const torch::Tensor& weight,
                              const torch::Tensor& bias, double slope);

}  // namespace likeness
