// A linear layer with weight normalisation, without ever making the normalised weight.

#pragma once

#include <torch/types.h>

namespace likeness {

// y = x W' + bias, W the weight of rows W_o = gain_o direction_o / norm_o; norm_o = |direction_o|, or |direction|
// (whole).
//   x          [N, in]
//   direction  [out, in]
//   gain, bias [out]
// The norm divides the product instead of the weight: with u = x direction' and s = gain / norm, y = s u + bias. Then,
// with q_o = sum over N of dy u,
//   dx = (s dy) direction;  dgain_o = q_o / norm_o;  dbias_o = sum over N of dy_o;
//   ddirection_o = sum over N of (s dy)_o x  -  c_o direction_o,  as norm_o falls with s:
//   c_o = gain_o q_o / norm_o^3, or for the whole the sum of these over all o.
// A mesh's layer has 5.6 million weights and few samples: each pass over them costs as much as the product.
torch::Tensor NormalisedLinear(const torch::Tensor& x, const torch::Tensor& direction, const torch::Tensor& gain,
                               bool whole, const torch::Tensor& bias);

}  // namespace likeness
