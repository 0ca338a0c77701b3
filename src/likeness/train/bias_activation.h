// A per-texel bias and leaky ReLU as one differentiable operation.

#pragma once

#include <torch/types.h>

namespace likeness {

// y = leaky_relu(x + bias): with a = x + bias, y = a where a > 0, slope a elsewhere.
//   x      [N, C, H, W] float32
//   bias   [C, H, W]
//   slope  in (0, 1]; 1 adds the bias alone
// Gradients: dx = dy where y > 0, slope dy elsewhere (a and y have the same sign); dbias = sum of dx over N.
//
// On the CPU each direction is one pass over memory, where separate operations take three: at high resolution training
// is bound by that. Reuses x's memory. Elsewhere, and where memory is not laid out alike, the plain operations.
torch::Tensor AddBiasAndActivate(const torch::Tensor& x, const torch::Tensor& bias, double slope);

}  // namespace likeness
