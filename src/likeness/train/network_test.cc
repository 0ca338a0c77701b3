#include "likeness/train/network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/random.h"
#include "likeness/train/plain_network.h"

namespace likeness {
namespace {

using Values = PlainNetwork::Values;

Architecture Small() {
  Architecture a;
  a.texture_size = 32;
  a.vertex_count = 5;
  a.latent = 6;
  return a;
}

// Random values everywhere, biases and gains too, so that no term can hide.
void Stir(const Network& network, uint64_t seed) {
  const torch::NoGradGuard no_grad;
  Random random(seed);
  for (const Parameter& parameter : network.parameters()) {
    const bool gain = parameter.name.ends_with(".gain");
    torch::Tensor noise = torch::empty(parameter.value.sizes(), torch::kFloat64);
    for (int64_t i = 0; i < noise.numel(); ++i) {
      noise.mutable_data_ptr<double>()[i] = gain ? random.Uniform(0.5, 1.5) : random.Normal() * 0.2;
    }
    parameter.value.copy_(noise);
  }
}

Values RandomValues(int64_t count, Random& random) {
  Values values(count);
  for (double& v : values) v = random.Normal();
  return values;
}

torch::Tensor ToTensor(Values& values, std::vector<int64_t> shape) {
  return torch::from_blob(values.data(), shape, torch::kFloat64).clone();
}

double LargestDifference(const torch::Tensor& tensor, const Values& expected) {
  const torch::Tensor values = tensor.to(torch::kFloat64).contiguous();
  EXPECT_EQ(static_cast<size_t>(values.numel()), expected.size());
  double largest = 0;
  for (size_t i = 0; i < expected.size(); ++i) {
    largest = std::max(largest, std::abs(values.const_data_ptr<double>()[i] - expected[i]));
  }
  return largest;
}

class NetworkOptions : public testing::TestWithParam<std::tuple<Conditioning, Normalisation, UntiedBias>> {};

TEST_P(NetworkOptions, ForwardEqualsThePlainNetwork) {
  Architecture a = Small();
  std::tie(a.conditioning, a.normalisation, a.untied_bias) = GetParam();
  const Network network(a, 3, torch::kFloat64);
  Stir(network, 4);
  const PlainNetwork plain{a, network.Folded()};
  // Folded weights are float32: 2^-24 relative, through ten layers of sums that do not grow beyond some hundreds.
  const double tolerance = 1e-4;

  Random random(5);
  Values texture = RandomValues(3 * 32 * 32, random), vertices = RandomValues(15, random);
  Values code = RandomValues(6, random), view = RandomValues(3, random);
  const torch::NoGradGuard no_grad;
  const Network::Encoding encoding = network.Encode(ToTensor(texture, {1, 3, 32, 32}), ToTensor(vertices, {1, 15}));
  EXPECT_LT(LargestDifference(torch::cat({encoding.mu, encoding.log_sigma}, 1), plain.Encode(texture, vertices)),
            tolerance);
  const Network::Decoding decoding = network.Decode(ToTensor(code, {1, 6}), ToTensor(view, {1, 3}));
  EXPECT_LT(LargestDifference(decoding.texture, plain.DecodeTexture(code, view)), tolerance);
  EXPECT_LT(LargestDifference(decoding.vertices, plain.DecodeVertices(code)), tolerance);
}

INSTANTIATE_TEST_SUITE_P(All, NetworkOptions,
                         testing::Combine(testing::Values(Conditioning::kRaw, Conditioning::kFc8, Conditioning::kFc32),
                                          testing::Values(Normalisation::kNone, Normalisation::kWeight),
                                          testing::Values(UntiedBias::kNone, UntiedBias::kDecoder,
                                                          UntiedBias::kEverywhere)));

// A folded network gives in float32 what the trained one gave.
TEST(Network, FoldedWeightsGiveTheSameOutput) {
  const Network trained(Small(), 3);
  Stir(trained, 4);
  const std::map<std::string, Tensor> weights = trained.Folded();
  const Network folded(Small(), weights);
  const torch::NoGradGuard no_grad;
  const torch::Tensor code = torch::randn({2, 6}), view = torch::randn({2, 3});
  EXPECT_TRUE(torch::equal(trained.Decode(code, view).texture, folded.Decode(code, view).texture));
  EXPECT_TRUE(torch::equal(trained.Decode(code, view).vertices, folded.Decode(code, view).vertices));
}

TEST(Network, SamplesOfABatchAreIndependent) {
  const Network network(Small(), 3, torch::kFloat64);
  Stir(network, 4);
  const torch::NoGradGuard no_grad;
  const torch::Tensor code = torch::randn({3, 6}, torch::kFloat64), view = torch::randn({3, 3}, torch::kFloat64);
  const torch::Tensor together = network.Decode(code, view).texture;
  const torch::Tensor alone = network.Decode(code.slice(0, 1, 2), view.slice(0, 1, 2)).texture;
  EXPECT_LT((together.slice(0, 1, 2) - alone).abs().max().item<double>(), 1e-12);
}

// Every parameter's gradient against the difference of two losses.
TEST(Network, GradientsEqualFiniteDifferences) {
  Architecture a = Small();
  a.texture_size = 16;
  const Network network(a, 3, torch::kFloat64);
  Stir(network, 4);
  for (const Parameter& parameter : network.parameters()) parameter.value.requires_grad_();
  const torch::Tensor texture = torch::randn({2, 3, 16, 16}, torch::kFloat64);
  const torch::Tensor vertices = torch::randn({2, 15}, torch::kFloat64);
  const torch::Tensor view = torch::randn({2, 3}, torch::kFloat64);
  const auto loss = [&] {
    const Network::Encoding encoding = network.Encode(texture, vertices);
    const Network::Decoding decoding = network.Decode(encoding.mu + encoding.log_sigma.exp() * 0.3, view);
    return (decoding.texture - texture).square().mean() + (decoding.vertices - vertices).square().mean();
  };
  loss().backward();

  const torch::NoGradGuard no_grad;
  Random random(6);
  for (const Parameter& parameter : network.parameters()) {
    double* values = parameter.value.mutable_data_ptr<double>();
    // Laid out in memory as the parameter is.
    const torch::Tensor gradient = torch::empty_like(parameter.value).copy_(parameter.value.grad());
    const double scale = gradient.abs().max().item<double>();
    EXPECT_GT(scale, 0) << parameter.name;
    for (int trial = 0; trial < 6; ++trial) {
      const int64_t i = random.Below(parameter.value.numel());
      const double step = 1e-6, saved = values[i];
      values[i] = saved + step;
      const double above = loss().item<double>();
      values[i] = saved - step;
      const double below = loss().item<double>();
      values[i] = saved;
      // Rounding of the loss: 1e-16 of some units, divided by the step; kinks of the activation add a little.
      EXPECT_NEAR(gradient.const_data_ptr<double>()[i], (above - below) / (2 * step), 1e-5 * scale + 1e-8)
          << parameter.name << " value " << i;
    }
  }
}

TEST(Network, SeedsDecideTheWeights) {
  const std::map<std::string, Tensor> one = Network(Small(), 1).Folded(), again = Network(Small(), 1).Folded(),
                                      two = Network(Small(), 2).Folded();
  EXPECT_EQ(one.at("decoder.code_fc.weight").values, again.at("decoder.code_fc.weight").values);
  EXPECT_NE(one.at("decoder.code_fc.weight").values, two.at("decoder.code_fc.weight").values);
}

TEST(Network, FreshWeightsKeepSignalsAtTheirScale) {
  Architecture a = Small();
  a.texture_size = 128;
  const Network network(a, 1);
  const torch::NoGradGuard no_grad;
  const Network::Encoding encoding = network.Encode(torch::randn({4, 3, 128, 128}), torch::randn({4, 15}));
  const double mu = encoding.mu.square().mean().sqrt().item<double>();
  EXPECT_GT(mu, 0.3);
  EXPECT_LT(mu, 3);
  const double texture = network.Decode(torch::randn({4, 6}), torch::randn({4, 3})).texture.std().item<double>();
  EXPECT_GT(texture, 0.02);
  EXPECT_LT(texture, 0.3);
}

}  // namespace
}  // namespace likeness
