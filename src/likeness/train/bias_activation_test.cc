#include "likeness/train/bias_activation.h"

#include <gtest/gtest.h>

namespace likeness {
namespace {

torch::Tensor LaidOut(const torch::Tensor& x, bool channels_last) {
  return x.clone(channels_last ? torch::MemoryFormat::ChannelsLast : torch::MemoryFormat::Contiguous);
}

// Output and gradients equal the plain operations' in every layout; sums over five samples may round differently.
TEST(BiasActivation, EqualsThePlainOperations) {
  torch::manual_seed(1);
  const torch::Tensor values = torch::randn({5, 6, 4, 4}), biases = torch::randn({1, 6, 4, 4});
  const torch::Tensor weights = torch::randn({5, 6, 4, 4});
  for (const double slope : {0.2, 1.0}) {
    for (const bool x_last : {false, true}) {
      for (const bool bias_last : {false, true}) {
        for (const bool gradient_last : {false, true}) {
          const torch::Tensor x = LaidOut(values, x_last).requires_grad_();
          const torch::Tensor bias = LaidOut(biases, bias_last).squeeze(0).detach().requires_grad_();
          const torch::Tensor y = AddBiasAndActivate(x * 1, bias, slope);
          (y * LaidOut(weights, gradient_last)).sum().backward();

          const torch::Tensor plain_x = values.clone().requires_grad_();
          const torch::Tensor plain_bias = biases.squeeze(0).clone().requires_grad_();
          const torch::Tensor plain = torch::leaky_relu(plain_x + plain_bias, slope);
          (plain * weights).sum().backward();
          EXPECT_TRUE(torch::equal(y, plain));
          EXPECT_TRUE(torch::equal(x.grad(), plain_x.grad()));
          EXPECT_LT((bias.grad() - plain_bias.grad()).abs().max().item<double>(), 1e-5);
        }
      }
    }
  }
}

}  // namespace
}  // namespace likeness
