#include "likeness/image/metrics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "likeness/base/random.h"

namespace likeness {
namespace {

ImageU8 RandomImage(int width, int height, int channels, uint64_t seed) {
  Random random(seed);
  ImageU8 image(width, height, channels);
  for (uint8_t& value : image.values()) value = static_cast<uint8_t>(random.Below(256));
  return image;
}

ImageU8 RandomMask(int width, int height, uint64_t seed) {
  ImageU8 mask = RandomImage(width, height, 1, seed);
  for (uint8_t& value : mask.values()) value = value < 100 ? 0 : 255;
  return mask;
}

double Luma(const ImageU8& image, int x, int y) {
  const uint8_t* p = image.at(x, y);
  return 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2];
}

// One window at a time, 121 taps, double precision.
double SlowSsim(const ImageU8& a, const ImageU8& b, const ImageU8& mask) {
  double total = 0;
  int count = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      if (*mask.at(x, y) == 0) continue;
      double w_sum = 0, ma = 0, mb = 0;
      const auto for_window = [&](auto&& visit) {
        for (int dy = -5; dy <= 5; ++dy) {
          for (int dx = -5; dx <= 5; ++dx) {
            const int px = x + dx, py = y + dy;
            if (px < 0 || py < 0 || px >= a.width() || py >= a.height() || *mask.at(px, py) == 0) continue;
            visit(std::exp(-(dx * dx + dy * dy) / (2 * 1.5 * 1.5)), Luma(a, px, py), Luma(b, px, py));
          }
        }
      };
      for_window([&](double w, double p, double q) { w_sum += w, ma += w * p, mb += w * q; });
      ma /= w_sum, mb /= w_sum;
      double va = 0, vb = 0, cov = 0;
      for_window([&](double w, double p, double q) {
        va += w / w_sum * (p - ma) * (p - ma);
        vb += w / w_sum * (q - mb) * (q - mb);
        cov += w / w_sum * (p - ma) * (q - mb);
      });
      const double c1 = 6.5025, c2 = 58.5225;
      total += (2 * ma * mb + c1) * (2 * cov + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2));
      ++count;
    }
  }
  return total / count;
}

TEST(MetricsTest, SquaredErrorCountsMaskedValuesOnly) {
  ImageU8 a(3, 1, 3), b(3, 1, 3), mask(3, 1, 1);
  a.at(0, 0)[0] = 10, b.at(0, 0)[2] = 255, a.at(1, 0)[1] = 99;
  *mask.at(0, 0) = 255, *mask.at(2, 0) = 1;
  SquaredError error = MaskedSquaredError(a, b, mask);
  EXPECT_EQ(error.count, 6);
  EXPECT_EQ(error.sum, 100 + 255 * 255);
  error += {8, 2};
  EXPECT_DOUBLE_EQ(error.Mean(), (100 + 255 * 255 + 8) / 8.0);
  EXPECT_EQ(SquaredError().Mean(), 0);
}

TEST(MetricsTest, PsnrOfKnownErrors) {
  EXPECT_DOUBLE_EQ(PsnrDb(255.0 * 255.0), 0);
  EXPECT_NEAR(PsnrDb(1), 48.1308, 1e-4);
  EXPECT_NEAR(PsnrDb(100), 28.1308, 1e-4);
  EXPECT_TRUE(std::isinf(PsnrDb(0)));
}

TEST(MetricsTest, SsimAgreesWithThePlainSum) {
  const int width = 23, height = 17;
  const ImageU8 a = RandomImage(width, height, 3, 1);
  ImageU8 b = a;
  Random random(2);
  for (uint8_t& value : b.values()) value = static_cast<uint8_t>((value + random.Below(60)) / 2 + 60);
  const ImageU8 whole(width, height, 1, 255), part = RandomMask(width, height, 3);
  for (const ImageU8& mask : {whole, part}) {
    const double expected = SlowSsim(a, b, mask);
    EXPECT_GT(expected, 0.2);
    EXPECT_LT(expected, 0.9);
    EXPECT_NEAR(MaskedSsim(a, b, mask), expected, 1e-5);
  }
}

TEST(MetricsTest, SsimOfKnownPairs) {
  const ImageU8 mask(20, 20, 1, 255), noise = RandomImage(20, 20, 3, 4);
  EXPECT_NEAR(MaskedSsim(noise, noise, mask), 1, 1e-6);
  // Without structure only the luminance term is left: (2 p q + C1) / (p^2 + q^2 + C1).
  const ImageU8 p(20, 20, 1, 50), q(20, 20, 1, 150);
  EXPECT_NEAR(MaskedSsim(p, q, mask), (2.0 * 50 * 150 + 6.5025) / (50.0 * 50 + 150.0 * 150 + 6.5025), 1e-5);
  EXPECT_EQ(MaskedSsim(p, q, ImageU8(20, 20, 1)), 1);
}

TEST(MetricsTest, SsimIgnoresWhatLiesOutsideTheMask) {
  ImageU8 a = RandomImage(20, 20, 3, 5), b = RandomImage(20, 20, 3, 6);
  const ImageU8 mask = RandomMask(20, 20, 7);
  const double before = MaskedSsim(a, b, mask);
  for (int i = 0; i < 400; ++i) {
    if (mask.values()[i] == 0) a.values()[3 * i] ^= 0xff;
  }
  EXPECT_EQ(MaskedSsim(a, b, mask), before);
}

}  // namespace
}  // namespace likeness
