#include "likeness/train/loss.h"

#include <gtest/gtest.h>

#include <cmath>

#include "likeness/base/random.h"

namespace likeness {
namespace {

// KL as its definition says, integral of p log(p / q), by the trapezoid rule over mu +- 12 sigma.
double IntegratedKl(double mu, double sigma) {
  const int steps = 20000;
  double sum = 0;
  for (int i = 0; i <= steps; ++i) {
    const double x = mu + sigma * (24.0 * i / steps - 12);
    const double log_p = -0.5 * std::pow((x - mu) / sigma, 2) - std::log(sigma);
    const double log_q = -0.5 * x * x;
    sum += std::exp(log_p) * (log_p - log_q);
  }
  return sum / std::sqrt(2 * M_PI) * 24 * sigma / steps;
}

TEST(Loss, KlEqualsItsIntegral) {
  for (const double mu : {-1.5, 0.0, 0.7}) {
    for (const double sigma : {0.2, 1.0, 2.5}) {
      const torch::Tensor value =
          KlDivergence(torch::full({1}, mu, torch::kFloat64), torch::full({1}, std::log(sigma), torch::kFloat64));
      EXPECT_NEAR(value.item<double>(), IntegratedKl(mu, sigma), 1e-9) << mu << " " << sigma;
    }
  }
}

TEST(Loss, TermsAreMeansOverTheirElements) {
  Random random(1);
  const auto filled = [&](std::vector<int64_t> shape) {
    torch::Tensor tensor = torch::empty(shape, torch::kFloat64);
    for (int64_t i = 0; i < tensor.numel(); ++i) tensor.mutable_data_ptr<double>()[i] = random.Normal();
    return tensor;
  };
  // Two frames, two textures each.
  Batch batch;
  batch.vertices = filled({2, 6});
  batch.texture = filled({4, 3, 4, 4});
  batch.seen = (filled({4, 1, 4, 4}) > 0).to(torch::kFloat64);
  const Network::Encoding encoding{filled({2, 5}), filled({2, 5})};
  const Network::Decoding decoding{filled({4, 3, 4, 4}), filled({4, 6})};
  const Loss loss = ComputeLoss({2, 3, 5}, batch, encoding, decoding);

  double texture = 0, geometry = 0, kl = 0;
  for (int n = 0; n < 4; ++n) {
    for (int c = 0; c < 3; ++c) {
      for (int i = 0; i < 16; ++i) {
        const double difference =
            decoding.texture[n][c][i / 4][i % 4].item<double>() - batch.texture[n][c][i / 4][i % 4].item<double>();
        texture += std::pow(batch.seen[n][0][i / 4][i % 4].item<double>() * difference, 2) / (4 * 3 * 16);
      }
    }
    for (int i = 0; i < 6; ++i) {
      geometry +=
          std::pow(decoding.vertices[n][i].item<double>() - batch.vertices[n / 2][i].item<double>(), 2) / (4 * 6);
    }
  }
  for (int f = 0; f < 2; ++f) {
    for (int i = 0; i < 5; ++i) {
      const double mu = encoding.mu[f][i].item<double>(), log_sigma = encoding.log_sigma[f][i].item<double>();
      kl += 0.5 * (std::exp(2 * log_sigma) + mu * mu - 1 - 2 * log_sigma) / 10;
    }
  }
  EXPECT_NEAR(loss.texture.item<double>(), texture, 1e-12);
  EXPECT_NEAR(loss.geometry.item<double>(), geometry, 1e-12);
  EXPECT_NEAR(loss.kl.item<double>(), kl, 1e-12);
  EXPECT_NEAR(loss.total.item<double>(), 2 * texture + 3 * geometry + 5 * kl, 1e-11);
}

}  // namespace
}  // namespace likeness
