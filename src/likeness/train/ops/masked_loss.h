// The mean squared error of textures over seen texels, as one operation.

#pragma once

#include <torch/types.h>

namespace likeness {

// L = mean over all N x 3 x S x S values of (weight (prediction - target))^2.
//   prediction, target  [N, 3, S, S]
//   weight              [N, 1, S, S]
// dprediction = dL 2 weight^2 (prediction - target) / count.
// On the CPU, for float32 stored with channels last, the loss and the gradient are made in one pass; the plain
// operations make five copies of the textures. The sum is in double precision, in an order that does not depend on
// threads. Elsewhere the plain operations.
torch::Tensor MaskedSquaredError(const torch::Tensor& prediction, const torch::Tensor& target,
                                 const torch::Tensor& weight);

}  // namespace likeness
