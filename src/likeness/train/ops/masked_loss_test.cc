#include "likeness/train/ops/masked_loss.h"

#include <gtest/gtest.h>

#include "likeness/train/ops/gradient_check.h"

namespace likeness {
namespace {

torch::Tensor ChannelsLast(const torch::Tensor& values) { return values.contiguous(torch::MemoryFormat::ChannelsLast); }

TEST(MaskedSquaredError, EqualsThePlainOperationInDoublePrecision) {
  torch::manual_seed(5);
  const torch::Tensor weight = torch::rand({2, 1, 70, 70}), target = torch::randn({2, 3, 70, 70});
  const torch::Tensor values = torch::randn({2, 3, 70, 70});
  const torch::Tensor fast = ChannelsLast(values).detach().requires_grad_();
  const torch::Tensor plain = values.to(torch::kFloat64).requires_grad_();
  const torch::Tensor loss = MaskedSquaredError(fast, ChannelsLast(target), weight);
  const torch::Tensor expected = ((plain - target) * weight).square().mean();
  (3 * loss).backward();
  (3 * expected).backward();
  // 256 texels for each float32 sum, and the rounding of the squares.
  EXPECT_NEAR(loss.item<double>(), expected.item<double>(), 1e-5 * expected.item<double>());
  const double largest = plain.grad().abs().max().item<double>();
  EXPECT_LT((fast.grad() - plain.grad()).abs().max().item<double>(), 1e-6 * largest);
}

TEST(MaskedSquaredError, PlainGradientsEqualFiniteDifferences) {
  torch::manual_seed(5);
  const auto real = torch::TensorOptions(torch::kFloat64);
  const torch::Tensor prediction = torch::randn({2, 3, 4, 4}, real).requires_grad_();
  const torch::Tensor target = torch::randn({2, 3, 4, 4}, real), weight = torch::rand({2, 1, 4, 4}, real);
  CheckGradients({prediction}, [&] { return MaskedSquaredError(prediction, target, weight); });
}

}  // namespace
}  // namespace likeness
