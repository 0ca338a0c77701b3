// Gradients against differences of the loss, for tests of operations.

#pragma once

#include <gtest/gtest.h>
#include <torch/types.h>

#include <cmath>
#include <functional>
#include <vector>

namespace likeness {

// Every `every`-th value of the inputs, which are float64 leaves and contiguous. The differences are good to the root
// of float64's precision: rounding of 1e-16 over a step of 1e-6.
inline void CheckGradients(const std::vector<torch::Tensor>& inputs, const std::function<torch::Tensor()>& loss,
                           int64_t every = 1) {
  loss().backward();
  const torch::NoGradGuard no_grad;
  for (size_t k = 0; k < inputs.size(); ++k) {
    const torch::Tensor gradient = inputs[k].grad().contiguous();
    for (int64_t i = 0; i < inputs[k].numel(); i += every) {
      double* const value = inputs[k].mutable_data_ptr<double>() + i;
      const double saved = *value, step = 1e-6;
      *value = saved + step;
      const double above = loss().item<double>();
      *value = saved - step;
      const double below = loss().item<double>();
      *value = saved;
      const double expected = (above - below) / (2 * step);
      EXPECT_NEAR(gradient.const_data_ptr<double>()[i], expected, 1e-5 * (1 + std::abs(expected)))
          << "input " << k << ", value " << i;
    }
  }
}

}  // namespace likeness
