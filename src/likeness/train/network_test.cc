#include "likeness/train/network.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "likeness/avatar/plain_network.h"
#include "likeness/base/random.h"

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
  std::vector<Parameter> all = network.parameters();
  for (const Parameter& statistic : network.statistics()) all.push_back(statistic);
  for (const Parameter& parameter : all) {
    const bool gain = parameter.name.ends_with(".gain") || parameter.name.ends_with(".variance");
    // Effective weights keep signals at about their scale.
    const auto fan_in = static_cast<double>(parameter.value.numel() / parameter.value.size(0));
    const double scale = parameter.name.ends_with(".weight") ? 1 / std::sqrt(fan_in) : 0.2;
    torch::Tensor noise = torch::empty(parameter.value.sizes(), torch::kFloat64);
    for (int64_t i = 0; i < noise.numel(); ++i) {
      noise.mutable_data_ptr<double>()[i] = gain ? random.Uniform(0.5, 1.5) : random.Normal() * scale;
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

// An architecture and a name for it.
struct Choice {
  std::string name;
  Architecture architecture;
};

Choice Choose(const std::string& name, const std::function<void(Architecture&)>& change) {
  Choice choice = {name, Small()};
  change(choice.architecture);
  return choice;
}

void ChooseMultiface(Architecture& a) {
  a.texture_size = 256;
  a.layout = Layout::kMultiface;
  a.normalisation = Normalisation::kWeightTensor;
  a.untied_bias = UntiedBias::kDecoderAndChannel;
}

// Three people, and frames with two named conditions.
void ChooseConditions(IdentityConditioning identity, Architecture& a) {
  a.identities = 3;
  a.identity = identity;
  a.identity_size = identity == IdentityConditioning::kLearned ? 4 : 0;
  a.conditions = {{"gaze", 2}, {"light", 1}};
}

// Each value of each choice, and those together that meet in one layer.
std::vector<Choice> Choices() {
  std::vector<Choice> choices;
  for (const std::string& conditioning : ConditioningNames()) {
    for (const std::string& normalisation : NormalisationNames()) {
      choices.push_back(Choose(conditioning + " " + normalisation, [&](Architecture& a) {
        a.conditioning = ParseConditioning(conditioning);
        a.normalisation = ParseNormalisation(normalisation);
      }));
    }
  }
  for (const std::string& untied : UntiedBiasNames()) {
    for (const std::string& normalisation : NormalisationNames()) {
      choices.push_back(Choose(untied + " bias " + normalisation, [&](Architecture& a) {
        a.untied_bias = ParseUntiedBias(untied);
        a.normalisation = ParseNormalisation(normalisation);
      }));
    }
  }
  for (const char* model : {"linear", "bilinear"}) {
    choices.push_back(Choose(model, [&](Architecture& a) { a.model = ParseModelKind(model); }));
  }
  for (const char* model : {"deep", "linear", "bilinear"}) {
    for (const std::string& identity : IdentityConditioningNames()) {
      choices.push_back(Choose(fmt::format("{} identity {}", model, identity), [&](Architecture& a) {
        a.model = ParseModelKind(model);
        ChooseConditions(ParseIdentityConditioning(identity), a);
      }));
    }
  }
  choices.push_back(Choose("nearest", [](Architecture& a) { a.upsampling = Upsampling::kNearest; }));
  choices.push_back(Choose("residual", [](Architecture& a) { a.residual = true; }));
  choices.push_back(Choose("nearest residual batch", [](Architecture& a) {
    a.upsampling = Upsampling::kNearest;
    a.residual = true;
    a.normalisation = Normalisation::kBatch;
    a.conditioning = Conditioning::kFc8All;
  }));
  return choices;
}

class NetworkChoice : public testing::TestWithParam<Choice> {};

void PrintTo(const Choice& choice, std::ostream* out) { *out << choice.name; }

void ExpectEqualsPlainNetwork(const Architecture& a) {
  const Network network(a, 3, torch::kFloat64);
  Stir(network, 4);
  const PlainNetwork plain{a, network.Folded()};
  // Folded weights are float32: 2^-24 relative, through up to ten layers of sums that do not grow beyond some hundreds.
  const double tolerance = 1e-4;

  Random random(5);
  const int64_t size = a.texture_size;
  Values texture = RandomValues(3 * size * size, random), vertices = RandomValues(15, random);
  Values code = RandomValues(6, random), view = RandomValues(3, random), named = RandomValues(NamedChannels(a), random);
  const int identity = a.identities - 1;
  const Values plain_condition = plain.Condition(identity, named);
  const torch::NoGradGuard no_grad;
  const torch::Tensor condition = network.Condition(torch::tensor({identity}, torch::kInt64),
                                                    ToTensor(named, {1, static_cast<int64_t>(named.size())}));
  const torch::Tensor z = ToTensor(code, {1, 6}), seen_from = ToTensor(view, {1, 3});
  const Network::Encoding encoding =
      network.Encode(ToTensor(texture, {1, 3, size, size}), ToTensor(vertices, {1, 15}), condition);
  EXPECT_LT(LargestDifference(torch::cat({encoding.mu, encoding.log_sigma}, 1),
                              plain.Encode(texture, vertices, plain_condition)),
            tolerance);
  const Network::Decoding decoding = network.Decode(z, seen_from, condition);
  EXPECT_LT(LargestDifference(decoding.texture, plain.DecodeTexture(code, view, plain_condition)), tolerance);
  EXPECT_LT(LargestDifference(decoding.vertices, plain.DecodeVertices(code, plain_condition)), tolerance);
  EXPECT_LT(LargestDifference(network.DecodeVertices(z, condition), plain.DecodeVertices(code, plain_condition)),
            tolerance);
}

TEST_P(NetworkChoice, ForwardEqualsThePlainNetwork) { ExpectEqualsPlainNetwork(GetParam().architecture); }

TEST(Network, MultifaceForwardEqualsThePlainNetwork) {
  Architecture a = Small();
  ChooseMultiface(a);
  ExpectEqualsPlainNetwork(a);
}

// A folded network gives in float32 what the trained one gave.
TEST(Network, FoldedWeightsGiveTheSameOutput) {
  const Network trained(Small(), 3);
  Stir(trained, 4);
  const std::map<std::string, Tensor> weights = trained.Folded();
  const Network folded(Small(), weights);
  const torch::NoGradGuard no_grad;
  const torch::Tensor code = torch::randn({2, 6}), view = torch::randn({2, 3});
  // The norm divides products there and weights here: roundings of float32, through five layers.
  const auto differ = [](const torch::Tensor& a, const torch::Tensor& b) { return (a - b).abs().max().item<double>(); };
  EXPECT_LT(differ(trained.Decode(code, view).texture, folded.Decode(code, view).texture), 1e-4);
  EXPECT_LT(differ(trained.Decode(code, view).vertices, folded.Decode(code, view).vertices), 1e-4);
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
TEST_P(NetworkChoice, GradientsEqualFiniteDifferences) {
  Architecture a = GetParam().architecture;
  a.texture_size = 16;
  const Network network(a, 3, torch::kFloat64);
  Stir(network, 4);
  for (const Parameter& parameter : network.parameters()) parameter.value.requires_grad_();
  const int64_t samples = a.identities > 1 ? a.identities : 2;
  const torch::Tensor texture = torch::randn({samples, 3, 16, 16}, torch::kFloat64);
  const torch::Tensor vertices = torch::randn({samples, 15}, torch::kFloat64);
  const torch::Tensor view = torch::randn({samples, 3}, torch::kFloat64);
  // Everybody takes part, so that every learned vector has a gradient.
  const torch::Tensor identity = torch::arange(samples, torch::kInt64).remainder(a.identities);
  const torch::Tensor named = torch::randn({samples, NamedChannels(a)}, torch::kFloat64).requires_grad_();
  const auto loss = [&] {
    const torch::AutoGradMode training(true);  // batch normalisation by the batch itself
    const torch::Tensor condition = network.Condition(identity, named);
    const Network::Encoding encoding = network.Encode(texture, vertices, condition);
    const Network::Decoding decoding = network.Decode(encoding.mu + encoding.log_sigma.exp() * 0.3, view, condition);
    return (decoding.texture - texture).square().mean() + (decoding.vertices - vertices).square().mean();
  };
  loss().backward();

  const torch::NoGradGuard no_grad;
  Random random(6);
  std::vector<Parameter> inputs = network.parameters();
  if (named.numel() > 0) inputs.push_back({"named conditions", named});
  for (const Parameter& parameter : inputs) {
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

INSTANTIATE_TEST_SUITE_P(All, NetworkChoice, testing::ValuesIn(Choices()));

// gain (x - mean) / deviation + bias with the batch's own mean and deviation, which the running ones follow.
TEST(Layer, BatchNormalisationByHand) {
  Architecture a = Small();
  a.normalisation = Normalisation::kBatch;
  const Network network(a, 3, torch::kFloat64);
  Stir(network, 4);
  const Layer& layer = network.layer("encoder.texture_conv.1");
  const auto value = [](const std::vector<Parameter>& all, const std::string& end) {
    for (const Parameter& p : all) {
      if (p.name.ends_with(end)) return p.value.clone();
    }
    return torch::Tensor();
  };
  const torch::Tensor gain = value(layer.parameters(), ".gain").view({1, -1, 1, 1});
  const torch::Tensor bias = value(layer.parameters(), ".bias"), weight = value(layer.parameters(), ".weight");
  const torch::Tensor old_mean = value(layer.statistics(), ".mean"), old_var = value(layer.statistics(), ".variance");
  const torch::Tensor x = torch::randn({3, 16, 16, 16}, torch::kFloat64);
  const torch::Tensor y = layer(x);

  const torch::Tensor features = torch::conv2d(x, weight, {}, 2, 1);
  const torch::Tensor mean = features.mean({0, 2, 3}, true), squares = (features - mean).square();
  const torch::Tensor expected = gain * (features - mean) / (squares.mean({0, 2, 3}, true) + 1e-5).sqrt() + bias;
  EXPECT_LT((y - expected).abs().max().item<double>(), 1e-10);
  const torch::Tensor variance = squares.sum({0, 2, 3}) / (3 * 8 * 8 - 1);
  const auto follows = [](const torch::Tensor& now, const torch::Tensor& before, const torch::Tensor& seen) {
    return (now - (0.9 * before + 0.1 * seen.flatten())).abs().max().item<double>();
  };
  EXPECT_LT(follows(value(layer.statistics(), ".mean"), old_mean, mean), 1e-12);
  EXPECT_LT(follows(value(layer.statistics(), ".variance"), old_var, variance), 1e-12);
}

// gain = 1 + rate * parameter, bias = rate * parameter; the first camera is left as it is.
TEST(Network, CameraColours) {
  const Network network(Small(), 1, torch::kFloat64, {3, 0.5});
  Stir(network, 2);
  std::map<std::string, torch::Tensor> colours;
  for (const Parameter& parameter : network.parameters()) {
    if (parameter.name.starts_with("colour.")) colours[parameter.name] = parameter.value.requires_grad_();
  }
  const torch::Tensor texture = torch::randn({4, 3, 8, 8}, torch::kFloat64);
  const torch::Tensor camera = torch::tensor({2, 0, 1, 2}, torch::kInt64);
  const torch::Tensor seen = network.InCameraColours(texture, camera);
  EXPECT_TRUE(torch::equal(seen[1], texture[1]));
  for (const int n : {0, 2, 3}) {
    const int64_t row = camera[n].item<int64_t>() - 1;
    for (int c = 0; c < 3; ++c) {
      const double gain = 1 + 0.5 * colours["colour.gain"][row][c].item<double>();
      const double bias = 0.5 * colours["colour.bias"][row][c].item<double>();
      EXPECT_LT((seen[n][c] - (texture[n][c] * gain + bias)).abs().max().item<double>(), 1e-14);
    }
  }
  const auto loss = [&] { return network.InCameraColours(texture, camera).pow(3).mean(); };
  loss().backward();
  const torch::NoGradGuard no_grad;
  for (auto& [name, value] : colours) {
    for (int64_t i = 0; i < value.numel(); ++i) {
      double& at = value.mutable_data_ptr<double>()[i];
      const double saved = at, step = 1e-5;
      at = saved + step;
      const double above = loss().item<double>();
      at = saved - step;
      const double below = loss().item<double>();
      at = saved;
      EXPECT_NEAR(value.grad().flatten()[i].item<double>(), (above - below) / (2 * step), 1e-8) << name << " " << i;
    }
  }
}

// Parameters as the trainer has them, against the list of keys of a published checkpoint of 38 cameras, whose colours
// are 6 values a camera.
TEST(Network, MultifaceHasThePublishedParameters) {
  Architecture a;
  ChooseMultiface(a);
  a.texture_size = 1024;
  a.vertex_count = 7306;
  a.latent = 256;
  int64_t count = 0;
  for (const Parameter& parameter : Network(a, 1, torch::kFloat32, {38}).parameters()) count += parameter.value.numel();
  // The list counts the first camera's constants too.
  EXPECT_EQ(count + 6, 24'313'578 + 6 * 38);
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
