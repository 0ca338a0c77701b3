#include "likeness/train/ops/normalised_linear.h"

#include <gtest/gtest.h>

#include "likeness/train/ops/gradient_check.h"

namespace likeness {
namespace {

torch::Tensor Plain(const torch::Tensor& x, const torch::Tensor& direction, const torch::Tensor& gain, bool whole,
                    const torch::Tensor& bias) {
  const torch::Tensor squares = direction.square();
  const torch::Tensor norm = whole ? squares.sum().sqrt().expand_as(gain) : squares.sum(1).sqrt();
  return torch::linear(x, direction * (gain / norm).unsqueeze(1), bias);
}

std::vector<torch::Tensor> Operands(torch::ScalarType type) {
  torch::manual_seed(4);
  std::vector<torch::Tensor> operands = {torch::randn({3, 7}), torch::randn({5, 7}), torch::randn({5}),
                                         torch::randn({5})};
  for (torch::Tensor& operand : operands) operand = operand.to(type).requires_grad_();
  return operands;
}

TEST(NormalisedLinear, EqualsThePlainOperationInDoublePrecision) {
  for (const bool whole : {false, true}) {
    const std::vector<torch::Tensor> a = Operands(torch::kFloat64), b = Operands(torch::kFloat64);
    const torch::Tensor y = NormalisedLinear(a[0], a[1], a[2], whole, a[3]);
    const torch::Tensor plain = Plain(b[0], b[1], b[2], whole, b[3]);
    y.square().sum().backward();
    plain.square().sum().backward();
    EXPECT_LT((y - plain).abs().max().item<double>(), 1e-13);
    for (size_t i = 0; i < a.size(); ++i) {
      EXPECT_LT((a[i].grad() - b[i].grad()).abs().max().item<double>(), 1e-12) << "operand " << i << " whole " << whole;
    }
  }
}

TEST(NormalisedLinear, GradientsEqualFiniteDifferences) {
  for (const bool whole : {false, true}) {
    const std::vector<torch::Tensor> a = Operands(torch::kFloat64);
    CheckGradients(a, [&] { return NormalisedLinear(a[0], a[1], a[2], whole, a[3]).square().sum(); });
  }
}

}  // namespace
}  // namespace likeness
