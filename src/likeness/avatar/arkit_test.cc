#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/avatar/arkit_fit.h"
#include "likeness/avatar/arkit_map.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::vector<std::string> kNames = {"jawOpen", "mouthFunnel", "browDownLeft", "cheekPuff"};

ArkitMap MakeMap() { return {kNames, {{0, -1}, {2, 2}, {0, 1}}, {1, -1}, {10, 20, 30, -10, -20, -30}}; }

TEST(ArkitMapTest, AddsUpTerms) {
  const std::vector<float> values = {0.5f, 0.25f, 0.1f, 1};
  EXPECT_THAT(TermValues(MakeMap().terms, values), ElementsAre(0.5, testing::DoubleNear(0.01, 1e-8), 0.125));
  EXPECT_THAT(MakeMap().CodeOf(values),
              ElementsAre(testing::FloatNear(1 + 5 + 0.2f + 3.75f, 1e-5f), testing::FloatNear(-9.95f, 1e-5f)));
}

TEST(ArkitMapTest, ComesBackFromAFileThatKeepsAllElse) {
  const ScratchFolder scratch;
  const std::vector<float> values = {1, 2, 3};
  WriteSafetensors(scratch / "plain.safetensors", {ViewOf("x", {3}, values)}, {{"format", "any"}});
  const SafetensorsFile plain(scratch / "plain.safetensors");
  EXPECT_FALSE(ReadArkitMap(plain, 2));
  ArkitMap map = MakeMap();
  WriteWithArkitMap(scratch / "a.safetensors", plain, map);
  // Once more: the file's own map is replaced.
  map.bias[0] = 5;
  WriteWithArkitMap(scratch / "a.safetensors", SafetensorsFile(scratch / "a.safetensors"), map);
  const SafetensorsFile file(scratch / "a.safetensors");
  const auto read = ReadArkitMap(file, 2);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->coefficients, map.coefficients);
  EXPECT_EQ(read->terms, map.terms);
  EXPECT_EQ(read->bias, map.bias);
  EXPECT_EQ(read->weights, map.weights);
  EXPECT_EQ(file.Floats("x", {3}), values);
  EXPECT_EQ(file.Metadata("format"), "any");
  EXPECT_THAT(ErrorOf([&] { ReadArkitMap(file, 3); }), HasSubstr("arkit.bias"));
}

TEST(ArkitMapTest, WrongOnesAreErrors) {
  const std::vector<float> bias = {1, 2}, weights = {1, 2, 3, 4, 5, 6};
  for (const char* wrong : {"x", "[]", "{}", R"({"version": 2, "coefficients": [], "terms": []})",
                            R"({"version": 1, "coefficients": ["a"], "terms": [["b"]]})",
                            R"({"version": 1, "coefficients": ["a"], "terms": [["a", "a", "a"]]})",
                            R"({"version": 1, "coefficients": ["a", "a"], "terms": [["a"], ["a"], ["a"]]})",
                            R"({"version": 1, "coefficients": ["a"], "terms": [["a"]]})"}) {
    const std::vector<TensorView> tensors = {ViewOf("arkit.bias", {2}, bias), ViewOf("arkit.weight", {2, 3}, weights)};
    std::string bytes = SafetensorsHeader(tensors, {{"arkit", wrong}});
    for (const TensorView& tensor : tensors) {
      bytes.append(reinterpret_cast<const char*>(tensor.bytes.data()), tensor.bytes.size());
    }
    EXPECT_THAT(ErrorOf([&] { ReadArkitMap(SafetensorsFile("FILE", bytes), 2); }), testing::StartsWith("FILE: "))
        << wrong;
  }
}

// Frames of several segments whose codes follow a known law.
class ArkitFitTest : public testing::Test {
 protected:
  using Law = std::function<std::vector<float>(const std::vector<float>&)>;

  static std::vector<ArkitFrame> Frames(const Law& law, double noise = 0) {
    Random random(5);
    std::vector<ArkitFrame> frames;
    for (int i = 0; i < 120; ++i) {
      ArkitFrame frame{"segment" + std::to_string(i / 10), {}, {}};
      for (size_t k = 0; k < kNames.size(); ++k) frame.coefficients.push_back(static_cast<float>(random.Uniform()));
      frame.code = law(frame.coefficients);
      for (float& v : frame.code) v += static_cast<float>(noise * random.Normal());
      frames.push_back(frame);
    }
    return frames;
  }

  // Code values are the coordinates of one vertex; another one, far away, does not count.
  static Vertices Decode(std::span<const float> code) {
    Vertices mesh(2, 3);
    mesh << code[0], code[1], 0, 1000 * code[0], 0, 0;
    return mesh;
  }

  static ArkitFit Fit(const std::vector<ArkitFrame>& frames) { return FitArkitMap(kNames, frames, Decode, {0}); }
};

TEST_F(ArkitFitTest, FindsALinearLaw) {
  const Law law = [](const std::vector<float>& c) {
    return std::vector<float>{3 + 2 * c[0] - 5 * c[3], -1 + c[1] + 4 * c[2]};
  };
  const ArkitFit fit = Fit(Frames(law));
  EXPECT_EQ(fit.best.terms, "linear");
  EXPECT_EQ(fit.best.strength, 1e-4);
  EXPECT_LT(fit.best.error_mm, 0.01);
  const std::vector<float> values = {1, 0, 1, 0};
  EXPECT_NEAR(fit.map.CodeOf(values)[0], 5, 0.01);
  EXPECT_NEAR(fit.map.CodeOf(values)[1], 3, 0.01);
}

TEST_F(ArkitFitTest, FindsProductsAndSquares) {
  const Law jaw = [](const std::vector<float>& c) { return std::vector<float>{2 * c[0] * c[1], c[2]}; };
  EXPECT_EQ(Fit(Frames(jaw)).best.terms, "jaw products");
  const Law square = [](const std::vector<float>& c) { return std::vector<float>{2 * c[0] * c[0], c[2]}; };
  EXPECT_EQ(Fit(Frames(square)).best.terms, "squares");
}

// What the coefficients do not tell is not learnt: the strongest ridge is the best, and the mean is what is left.
TEST_F(ArkitFitTest, LearnsNothingFromNoise) {
  const ArkitFit fit = Fit(Frames([](const std::vector<float>&) { return std::vector<float>{7, -7}; }, 1));
  EXPECT_EQ(fit.best.strength, 1);
  const std::vector<float> values = {1, 0, 1, 0};
  EXPECT_NEAR(fit.map.CodeOf(values)[0], 7, 0.5);
}

// No small change of a weight lowers what the ridge minimises, mean |code - map|^2 + strength |scaled weights|^2.
TEST_F(ArkitFitTest, MinimisesTheRidgesObjective) {
  const std::vector<ArkitFrame> frames = Frames(
      [](const std::vector<float>& c) {
        return std::vector<float>{c[0] + c[1] * c[2], c[3]};
      },
      0.3);
  const ArkitFit fit = Fit(frames);
  const size_t terms = fit.map.terms.size();
  std::vector<double> deviation(terms), mean(terms);
  for (size_t k = 0; k < terms; ++k) {
    for (const ArkitFrame& f : frames) mean[k] += TermValues(fit.map.terms, f.coefficients)[k] / 120;
    for (const ArkitFrame& f : frames) {
      deviation[k] += std::pow(TermValues(fit.map.terms, f.coefficients)[k] - mean[k], 2) / 120;
    }
    deviation[k] = std::sqrt(deviation[k]);
  }
  const auto objective = [&](const ArkitMap& map) {
    double sum = 0;
    for (const ArkitFrame& f : frames) {
      const std::vector<float> code = map.CodeOf(f.coefficients);
      for (size_t i = 0; i < code.size(); ++i) sum += std::pow(code[i] - f.code[i], 2) / 120;
    }
    for (size_t i = 0; i < map.weights.size(); ++i) {
      sum += fit.best.strength * std::pow(map.weights[i] * deviation[i % terms], 2);
    }
    return sum;
  };
  const double least = objective(fit.map);
  for (size_t i = 0; i < fit.map.weights.size() + fit.map.bias.size(); ++i) {
    for (const float step : {-0.02f, 0.02f}) {
      ArkitMap changed = fit.map;
      (i < changed.weights.size() ? changed.weights[i] : changed.bias[i - changed.weights.size()]) += step;
      EXPECT_GT(objective(changed), least) << i << " " << step;
    }
  }
}

// The mean over the left-out frames of their distance, each predicted by a fit to the other segments.
TEST_F(ArkitFitTest, TwoSegmentsPredictEachOther) {
  const std::vector<float> none(4, 0.5f);
  const std::vector<ArkitFrame> frames = {{"a", none, {1, 0}}, {"a", none, {3, 0}}, {"b", none, {6, 0}}};
  // Coefficients that never change leave the mean of the others: 6 for both of a, 2 for b.
  for (const ArkitCandidate& candidate : Fit(frames).candidates) {
    EXPECT_NEAR(candidate.error_mm, (5 + 3 + 4) / 3.0, 1e-5);
  }
  EXPECT_THAT(ErrorOf([&] { Fit({frames[0], frames[1]}); }), HasSubstr("two segments or more"));
}

}  // namespace
}  // namespace likeness
