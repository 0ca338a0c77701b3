#include "likeness/train/ops/convolution.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "likeness/train/ops/gradient_check.h"

namespace likeness {
namespace {

struct Case {
  ConvolutionKind kind;
  int samples, height, width, large, small;
  bool untied;
  double slope;
};

std::string Name(const Case& c, const RowKernels& kernels) {
  return fmt::format("{} {}: {} samples, small image {} x {} x {}, large channels {}, {} bias, slope {}, seed 3",
                     kernels.name, c.kind == ConvolutionKind::kUp ? "up" : "down", c.samples, c.height, c.width,
                     c.small, c.large, c.untied ? "untied" : "tied", c.slope);
}

struct Values {
  torch::Tensor y, dx, dweight, dbias;
};

// What an implementation makes of the case's operands, drawn from the seed, in `type`.
template <typename Function>
Values RunCase(const Case& c, torch::ScalarType type, const Function& function) {
  torch::manual_seed(3);
  const bool up = c.kind == ConvolutionKind::kUp;
  const int in = up ? c.small : c.large, out = up ? c.large : c.small;
  const int in_scale = up ? 1 : 2, out_scale = up ? 2 : 1;
  const auto leaf = [&](const torch::Tensor& values) { return values.to(type).requires_grad_(); };
  torch::Tensor x = leaf(torch::randn({c.samples, in, in_scale * c.height, in_scale * c.width}));
  torch::Tensor weight = leaf(torch::randn({c.small, c.large, 4, 4}));
  torch::Tensor bias =
      leaf(c.untied ? torch::randn({out, out_scale * c.height, out_scale * c.width}) : torch::randn({out}));
  const torch::Tensor dy = torch::randn({c.samples, out, out_scale * c.height, out_scale * c.width}).to(type);
  const torch::Tensor y = function(c.kind, x, weight, bias, c.slope);
  (y.to(type) * dy).sum().backward();
  return {y.detach(), x.grad(), weight.grad(), bias.grad()};
}

// What rounding may do to sums of `terms` products of normal values. Rounded operands (half a last place: `unit`) move
// every product by an independent sqrt(2) unit or less; adding up in float32 moves a partial sum, which grows with the
// root of the terms so far, by 2^-24 of itself each time. Six deviations of the sum of both, for the worst of thousands
// of values, and the rounding of the result itself.
double Tolerance(double unit, double terms, double largest) {
  return 6 * (unit * std::sqrt(2 * terms) + std::ldexp(terms, -24)) + unit * largest;
}

void ExpectClose(const torch::Tensor& is, const torch::Tensor& should, double unit, double terms,
                 const std::string& what) {
  ASSERT_EQ(is.sizes(), should.sizes()) << what;
  const double largest = should.abs().max().item<double>();
  EXPECT_GT(largest, 0) << what;
  EXPECT_LT((is.to(torch::kFloat64) - should).abs().max().item<double>(), Tolerance(unit, terms, largest)) << what;
}

class RowKernelsTest : public testing::TestWithParam<Case> {};

TEST_P(RowKernelsTest, EqualsThePlainOperationInDoublePrecision) {
  const Case c = GetParam();
  std::vector<const char*> missing;
  for (const RowKernels* kernels : AvailableRowKernels(&missing)) {
    const std::string name = Name(c, *kernels);
    const bool half = kernels->element_bytes == 2;
    const Values should = RunCase(c, torch::kFloat64, ConvolvePlainly);
    const Values is = RunCase(c, torch::kFloat32, [&](auto kind, auto x, auto weight, auto bias, double slope) {
      return ConvolveWith(*kernels, kind, x, weight, bias, slope);
    });
    const double unit = std::ldexp(1, half ? -9 : -24);
    const double down = 16.0 * c.large, up = 4.0 * c.small;
    const bool is_up = c.kind == ConvolutionKind::kUp;
    ExpectClose(is.y, should.y, unit, is_up ? up : down, name + ", y");
    if (half && c.slope != 1) continue;  // a rounded y changes sign here and there, and with it single gradients
    ExpectClose(is.dx, should.dx, unit, is_up ? down : up, name + ", dx");
    ExpectClose(is.dweight, should.dweight, unit, c.samples * c.height * c.width, name + ", dweight");
    ExpectClose(is.dbias, should.dbias, unit, c.samples * (c.untied ? 1 : c.height * c.width * 4), name + ", dbias");
  }
  for (const char* name : missing) fmt::print("this processor cannot run the kernels '{}': not tested\n", name);
}

INSTANTIATE_TEST_SUITE_P(Layers, RowKernelsTest,
                         testing::Values(Case{ConvolutionKind::kUp, 2, 16, 16, 16, 16, true, 0.2},
                                         Case{ConvolutionKind::kUp, 3, 19, 21, 3, 16, true, 1},
                                         Case{ConvolutionKind::kUp, 1, 16, 40, 16, 32, false, 1},
                                         Case{ConvolutionKind::kUp, 1, 17, 33, 32, 48, true, 1},
                                         Case{ConvolutionKind::kDown, 2, 16, 16, 3, 16, true, 0.2},
                                         Case{ConvolutionKind::kDown, 3, 19, 21, 16, 16, true, 1},
                                         Case{ConvolutionKind::kDown, 1, 16, 40, 32, 64, false, 1},
                                         Case{ConvolutionKind::kDown, 2, 17, 33, 16, 32, false, 0.2}));

// The plain operation itself against differences of its output: x, weight and bias, a few values each.
TEST(Convolution, PlainGradientsEqualFiniteDifferences) {
  for (const ConvolutionKind kind : {ConvolutionKind::kUp, ConvolutionKind::kDown}) {
    const Case c{kind, 2, 3, 3, 2, 3, true, 0.2};
    torch::manual_seed(3);
    const bool up = kind == ConvolutionKind::kUp;
    const auto real = torch::TensorOptions(torch::kFloat64);
    std::vector<torch::Tensor> inputs = {torch::randn({2, up ? 3 : 2, up ? 3 : 6, up ? 3 : 6}, real).requires_grad_(),
                                         torch::randn({3, 2, 4, 4}, real).requires_grad_(),
                                         torch::randn({up ? 2 : 3, up ? 6 : 3, up ? 6 : 3}, real).requires_grad_()};
    const auto loss = [&] { return ConvolvePlainly(kind, inputs[0], inputs[1], inputs[2], c.slope).square().sum(); };
    CheckGradients(inputs, loss, 7);
  }
}

}  // namespace
}  // namespace likeness
