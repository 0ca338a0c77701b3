#include "likeness/image/metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "likeness/base/error.h"

namespace likeness {
namespace {

constexpr int kRadius = 5;
constexpr double kSigma = 1.5;

void CheckShapes(const ImageU8& a, const ImageU8& b, const ImageU8& mask) {
  LIKENESS_CHECK(a.SameShape(b));
  LIKENESS_CHECK(mask.channels() == 1 && mask.width() == a.width() && mask.height() == a.height());
}

std::array<float, 2 * kRadius + 1> GaussianWeights() {
  std::array<float, 2 * kRadius + 1> weights;
  for (int i = -kRadius; i <= kRadius; ++i) {
    weights[i + kRadius] = static_cast<float>(std::exp(-i * i / (2 * kSigma * kSigma)));
  }
  return weights;
}

// Luma in [-128, 127]: the offset keeps the difference of moments exact enough in float. 0 outside the mask.
ImageF MaskedLuma(const ImageU8& image, const ImageU8& mask) {
  ImageF luma(image.width(), image.height(), 1);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (*mask.at(x, y) == 0) continue;
      const uint8_t* p = image.at(x, y);
      const float grey = image.channels() == 1 ? static_cast<float>(*p)
                                               : 0.299f * static_cast<float>(p[0]) + 0.587f * static_cast<float>(p[1]) +
                                                     0.114f * static_cast<float>(p[2]);
      *luma.at(x, y) = grey - 128;
    }
  }
  return luma;
}

// Unnormalised Gaussian sums; nothing lies outside the image.
ImageF GaussianSum(const ImageF& image) {
  static const auto kWeights = GaussianWeights();
  const int width = image.width(), height = image.height();
  ImageF across(width, height, 1), sum(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int d = -kRadius; d <= kRadius; ++d) {
      const float weight = kWeights[d + kRadius];
      const int first = std::max(0, -d), last = std::min(width, width - d);
      for (int x = first; x < last; ++x) *across.at(x, y) += weight * *image.at(x + d, y);
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int d = -kRadius; d <= kRadius; ++d) {
      if (y + d < 0 || y + d >= height) continue;
      const float weight = kWeights[d + kRadius];
      for (int x = 0; x < width; ++x) *sum.at(x, y) += weight * *across.at(x, y + d);
    }
  }
  return sum;
}

ImageF Product(const ImageF& a, const ImageF& b) {
  ImageF product(a.width(), a.height(), 1);
  std::transform(a.values().begin(), a.values().end(), b.values().begin(), product.values().begin(),
                 std::multiplies<>());
  return product;
}

}  // namespace

SquaredError& SquaredError::operator+=(const SquaredError& other) {
  sum += other.sum;
  count += other.count;
  return *this;
}

SquaredError MaskedSquaredError(const ImageU8& a, const ImageU8& b, const ImageU8& mask) {
  CheckShapes(a, b, mask);
  int64_t sum = 0, count = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      if (*mask.at(x, y) == 0) continue;
      count += a.channels();
      for (int c = 0; c < a.channels(); ++c) {
        const int difference = int{a.at(x, y)[c]} - int{b.at(x, y)[c]};
        sum += difference * difference;
      }
    }
  }
  return {static_cast<double>(sum), count};
}

double PsnrDb(double mse) {
  return mse > 0 ? 10 * std::log10(255.0 * 255.0 / mse) : std::numeric_limits<double>::infinity();
}

double MaskedSsim(const ImageU8& a, const ImageU8& b, const ImageU8& mask) {
  CheckShapes(a, b, mask);
  constexpr double c1 = (0.01 * 255) * (0.01 * 255), c2 = (0.03 * 255) * (0.03 * 255);
  ImageF inside(a.width(), a.height(), 1);
  std::transform(mask.values().begin(), mask.values().end(), inside.values().begin(),
                 [](uint8_t m) { return m != 0 ? 1.0f : 0.0f; });
  const ImageF luma_a = MaskedLuma(a, mask), luma_b = MaskedLuma(b, mask);
  const ImageF weight = GaussianSum(inside), sum_a = GaussianSum(luma_a), sum_b = GaussianSum(luma_b);
  const ImageF sum_aa = GaussianSum(Product(luma_a, luma_a)), sum_bb = GaussianSum(Product(luma_b, luma_b)),
               sum_ab = GaussianSum(Product(luma_a, luma_b));
  double total = 0;
  int64_t count = 0;
  for (size_t i = 0; i < mask.values().size(); ++i) {
    if (mask.values()[i] == 0) continue;
    const double w = weight.values()[i];
    const double mean_a = sum_a.values()[i] / w, mean_b = sum_b.values()[i] / w;
    const double var_a = std::max(0.0, sum_aa.values()[i] / w - mean_a * mean_a);
    const double var_b = std::max(0.0, sum_bb.values()[i] / w - mean_b * mean_b);
    const double covariance = sum_ab.values()[i] / w - mean_a * mean_b;
    const double mu_a = mean_a + 128, mu_b = mean_b + 128;
    total += (2 * mu_a * mu_b + c1) * (2 * covariance + c2) / ((mu_a * mu_a + mu_b * mu_b + c1) * (var_a + var_b + c2));
    ++count;
  }
  return count > 0 ? total / static_cast<double>(count) : 1;
}

}  // namespace likeness
