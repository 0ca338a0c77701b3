#include "likeness/train/step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>

#include "likeness/train/ops/precision.h"
#include "likeness/train/ops/row_kernels.h"

namespace likeness {
namespace {

constexpr int kSteps = 50;

// Smooth textures that depend on the frame and on the view, so that there is something to learn.
Batch MakeBatch(int side, int vertices) {
  torch::manual_seed(8);
  constexpr int kFrames = 2, kViews = 2;
  Batch batch;
  const torch::Tensor coarse = torch::randn({kFrames, 3, 4, 4});
  const auto rows = [](const torch::Tensor& t) { return t.contiguous(torch::MemoryFormat::ChannelsLast); };
  batch.average = rows(torch::upsample_bilinear2d(coarse, {side, side}, false));
  batch.vertices = torch::randn({kFrames, 3 * vertices});
  batch.view = torch::randn({kFrames * kViews, 3});
  const torch::Tensor tilt = batch.view.slice(1, 0, 1).unsqueeze(2).unsqueeze(3);
  batch.texture = rows(batch.average.repeat_interleave(kViews, 0) + 0.3 * tilt);
  batch.seen = (torch::rand({kFrames * kViews, 1, side, side}) > 0.2).to(torch::kFloat32);
  return batch;
}

std::vector<double> LossCurve(torch::ScalarType type, Precision precision, int first_noise = 0) {
  Architecture architecture;
  architecture.texture_size = 64;  // the two layers at the image run on row kernels in float32
  architecture.vertex_count = 20;
  architecture.latent = 16;
  const Network network(architecture, 5, type);
  Optimiser optimiser(network.parameters());
  Batch batch = MakeBatch(64, 20);
  for (torch::Tensor* t : {&batch.average, &batch.vertices, &batch.texture, &batch.seen, &batch.view}) *t = t->to(type);
  const PrecisionScope scope(precision);
  const Peers alone;
  GradientExchange exchange(alone, network.parameters());
  std::vector<double> losses;
  for (int i = 0; i < kSteps; ++i) {
    const auto noise = static_cast<uint64_t>(first_noise + i);
    losses.push_back(
        TrainStep(network, optimiser, alone, exchange, batch, LossWeights{}, nullptr, noise, 1e-3, 1).total);
  }
  return losses;
}

double MeanOfLast(const std::vector<double>& losses, int count) {
  return std::accumulate(losses.end() - count, losses.end(), 0.0) / count;
}

// Root mean square over the steps.
double Distance(const std::vector<double>& a, const std::vector<double>& b) {
  double squares = 0;
  for (size_t i = 0; i < a.size(); ++i) squares += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(squares / static_cast<double>(a.size()));
}

// float64 takes LibTorch's own operations all the way: the plain path. Same data, weights and noise.
TEST(TrainStep, LossCurveEqualsThePlainPaths) {
  const std::vector<double> plain = LossCurve(torch::kFloat64, Precision::kFloat32);
  EXPECT_LT(plain.back(), 0.5 * plain.front()) << "it learns";
  const std::vector<double> fast = LossCurve(torch::kFloat32, Precision::kFloat32);
  // Adam's first steps have the size of the rate whatever the gradient's: rounding flips the sign of those near 0, and
  // the curves drift apart by a share of each step's progress.
  for (int i = 0; i < kSteps; ++i) EXPECT_NEAR(fast[i], plain[i], 0.01 * plain[i]) << "step " << i;
}

TEST(TrainStep, LossCurveInBfloat16IsTheSameWithinNoise) {
  if (Bfloat16RowKernels() == nullptr) GTEST_SKIP() << "this processor has no matrix unit for bfloat16";
  const std::vector<double> plain = LossCurve(torch::kFloat64, Precision::kFloat32);
  const std::vector<double> half = LossCurve(torch::kFloat32, Precision::kBfloat16);
  EXPECT_NE(half, LossCurve(torch::kFloat32, Precision::kFloat32)) << "the scope has an effect";
  // Before any step the losses differ by the roundings of features alone: 2^-9 each, through some layers.
  EXPECT_NEAR(half.front(), plain.front(), 0.01 * plain.front());
  // Afterwards they lead apart, as other draws of the codes' noise do; they must do so by less than half as much.
  const std::vector<double> other = LossCurve(torch::kFloat64, Precision::kFloat32, /*first_noise=*/1000);
  RecordProperty("distance", std::to_string(Distance(half, plain)));
  RecordProperty("distance_of_noise", std::to_string(Distance(other, plain)));
  EXPECT_LT(Distance(half, plain), 0.5 * Distance(other, plain));
  EXPECT_NEAR(MeanOfLast(half, 10), MeanOfLast(plain, 10), 0.02 * MeanOfLast(plain, 10));
}

}  // namespace
}  // namespace likeness
