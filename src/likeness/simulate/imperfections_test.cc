#include "likeness/simulate/imperfections.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "likeness/base/parallel.h"
#include "likeness/base/testing.h"
#include "likeness/image/srgb.h"
#include "likeness/simulate/open_head.h"
#include "likeness/simulate/rig.h"

namespace likeness {
namespace {

struct Subject {
  OpenedHead opened = OpenHead("plain", "");
  Vertices neutral = opened.head->Pose(std::array<float, kExpressionCount>{}).tracked;

  Imperfections Flawed(const ImperfectionOptions& options, uint64_t seed = 1) const {
    return Imperfections(options, seed, opened.head->tracked_topology(), neutral);
  }
};

const Subject& TheSubject() {
  static const Subject subject;
  return subject;
}

// Root mean square of rows' lengths.
double Rms(const Vertices& difference) {
  return std::sqrt(difference.cast<double>().squaredNorm() / static_cast<double>(difference.rows()));
}

TEST(ImperfectionsTest, NoneAreOnByDefault) {
  const Imperfections none = TheSubject().Flawed({});
  EXPECT_EQ(none.Tracked(TheSubject().neutral, 1), TheSubject().neutral);
  Camera camera = LookAt({0, 0, 1000}, {0, 0, 0}, {0, 1, 0}, 1000, 64, 64);
  EXPECT_EQ(none.Calibrated(camera).intrinsics, camera.intrinsics);
  ImageU8 image(8, 8, 3, 100);
  none.Photograph({"a", "1"}, "cam", &image);
  EXPECT_EQ(image, ImageU8(8, 8, 3, 100));
}

TEST(ImperfectionsTest, CalibrationsMissByAsManyPixelsAsAskedFor) {
  RigOptions options;
  options.cameras = 6;
  const Vertices& head = TheSubject().neutral;
  const Rig rig = MakeRig(options, head);
  for (const double error_px : {0.3, 2.0, 20.0}) {
    const Imperfections flawed = TheSubject().Flawed({.calibration_error_px = error_px});
    for (const Camera& camera : rig.cameras) {
      const Camera given = flawed.Calibrated(camera);
      double sum = 0;
      for (int v = 0; v < head.rows(); ++v) {
        const Eigen::Vector3d p = head.row(v).transpose().cast<double>();
        sum += (given.Project(p) - camera.Project(p)).squaredNorm();
      }
      EXPECT_NEAR(std::sqrt(sum / static_cast<double>(head.rows())), error_px, 0.02 * error_px) << camera.name;
      EXPECT_LT(RotationDefect(given.cam_from_world.rotation), 1e-12);
      EXPECT_NE(given.intrinsics, camera.intrinsics);
    }
  }
}

TEST(ImperfectionsTest, TrackingNoiseIsAsLargeAsAskedForAndSmooth) {
  const Vertices& head = TheSubject().neutral;
  const double noise_mm = 0.8;
  double squares = 0, along_surface = 0, along_time = 0, later = 0;
  int64_t edges = 0;
  constexpr int kSeeds = 12;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    const Imperfections flawed = TheSubject().Flawed({.tracking_noise_mm = noise_mm}, seed);
    const Vertices now = flawed.Tracked(head, 3) - head;
    squares += now.squaredNorm() / static_cast<double>(now.rows());
    const Vertices soon = flawed.Tracked(head, 3 + 1.0 / 30) - head, much_later = flawed.Tracked(head, 13) - head;
    along_time += now.cwiseProduct(soon).sum() / now.rows();
    later += now.cwiseProduct(much_later).sum() / now.rows();
    for (const Eigen::Vector3i& t : TheSubject().opened.head->tracked_topology().triangles) {
      along_surface += now.row(t[0]).dot(now.row(t[1]));
      ++edges;
    }
  }
  const double variance = noise_mm * noise_mm;
  EXPECT_NEAR(std::sqrt(squares / kSeeds), noise_mm, 0.1 * noise_mm);
  // Nine tenths of the variance are shared by neighbours and by neighbouring frames, none by far ones.
  EXPECT_GT(along_surface / static_cast<double>(edges), 0.6 * variance);
  EXPECT_GT(along_time / kSeeds, 0.7 * variance);
  EXPECT_LT(std::abs(later / kSeeds), 0.25 * variance);
}

TEST(ImperfectionsTest, SmoothingRemovesDetailAndKeepsTheSize) {
  const Vertices& head = TheSubject().neutral;
  Vertices rough = head;
  for (int v = 0; v < rough.rows(); ++v) rough(v, v % 3) += v % 2 == 0 ? 0.5f : -0.5f;
  const Imperfections smooth = TheSubject().Flawed({.tracking_smoothing = 10});
  const Vertices from_rough = smooth.Tracked(rough, 0), from_clean = smooth.Tracked(head, 0);
  EXPECT_LT(Rms(from_rough - from_clean), 0.4 * Rms(rough - head));
  EXPECT_LT(Rms(from_clean - head), 3);
  const auto height = [](const Vertices& v) { return v.col(1).maxCoeff() - v.col(1).minCoeff(); };
  EXPECT_NEAR(height(from_clean), height(head), 0.02 * height(head));
}

struct Statistics {
  double mean = 0, deviation = 0;
};

Statistics StatisticsOf(const ImageU8& image) {
  double sum = 0, squares = 0;
  for (const uint8_t v : image.values()) sum += v, squares += double{1} * v * v;
  const auto n = static_cast<double>(image.values().size());
  return {sum / n, std::sqrt(squares / n - sum / n * sum / n)};
}

TEST(ImperfectionsTest, SensorNoiseIsAsStrongAsAskedForAndGrowsWithLight) {
  const Imperfections flawed = TheSubject().Flawed({.sensor_noise = 4});
  const auto noise = [&](uint8_t level) {
    ImageU8 image(200, 200, 3, level);
    flawed.Photograph({"a", "1"}, "cam", &image);
    return StatisticsOf(image);
  };
  const Statistics grey = noise(128);
  EXPECT_NEAR(grey.mean, 128, 0.3);
  EXPECT_NEAR(grey.deviation, 4, 0.1);
  // In linear light the variance of shot noise is in proportion to it.
  const auto linear_variance = [&](uint8_t level) {
    const double slope = (LinearFromSrgb((level + 1) / 255.0f) - LinearFromSrgb((level - 1) / 255.0f)) / 2;
    return std::pow(noise(level).deviation * slope, 2);
  };
  const double ratio = LinearFromSrgb(180 / 255.0f) / LinearFromSrgb(100 / 255.0f);
  EXPECT_NEAR(linear_variance(180) / linear_variance(100), ratio, 0.1 * ratio);
}

TEST(ImperfectionsTest, ImagesDependOnFrameCameraAndSeedAndNotOnThreads) {
  const auto photograph = [&](const char* frame, const char* camera, uint64_t seed) {
    ImageU8 image(64, 64, 3, 128);
    TheSubject().Flawed({.lens_blur_px = 1, .sensor_noise = 4}, seed).Photograph({"a", frame}, camera, &image);
    return image;
  };
  SetThreadCount(1);
  const ImageU8 image = photograph("1", "cam", 1);
  SetThreadCount(3);
  EXPECT_EQ(photograph("1", "cam", 1), image);
  SetThreadCount(0);
  EXPECT_NE(photograph("2", "cam", 1), image);
  EXPECT_NE(photograph("1", "other", 1), image);
  EXPECT_NE(photograph("1", "cam", 2), image);
}

TEST(ImperfectionsTest, ColoursAndExposuresSpreadAsAskedFor) {
  const Imperfections flawed = TheSubject().Flawed({.exposure_flicker = 0.05, .colour_gain = 0.04, .colour_bias = 3});
  double gains = 0, biases = 0, exposures = 0;
  constexpr int kCount = 600;
  for (int i = 0; i < kCount; ++i) {
    Eigen::Array3d gain, bias;
    flawed.Colours(std::to_string(i), &gain, &bias);
    gains += (gain - 1).square().sum() / (3 * kCount);
    biases += bias.square().sum() / (3 * kCount);
    exposures += std::pow(flawed.Exposure({"a", std::to_string(i)}) - 1, 2) / kCount;
  }
  // A little less than asked for: extremes are cut off.
  EXPECT_NEAR(std::sqrt(gains), 0.04, 0.003);
  EXPECT_NEAR(std::sqrt(biases), 3, 0.2);
  EXPECT_NEAR(std::sqrt(exposures), 0.05, 0.005);

  ImageU8 image(4, 4, 3, 150);
  const FrameId frame = {"a", "7"};
  flawed.Photograph(frame, "cam", &image);
  Eigen::Array3d gain, bias;
  flawed.Colours("cam", &gain, &bias);
  for (int c = 0; c < 3; ++c) {
    const double light = flawed.Exposure(frame) * LinearFromSrgb(150 / 255.0f);
    EXPECT_NEAR(image.at(1, 1)[c], 255 * SrgbFromLinear(static_cast<float>(light)) * gain[c] + bias[c], 0.51);
  }
}

TEST(ImperfectionsTest, BlurSpreadsAnEdgeAsAGaussianDoes) {
  const double sigma = 2.5;
  const Imperfections flawed = TheSubject().Flawed({.lens_blur_px = sigma});
  ImageU8 image(64, 40, 3);
  for (int y = 0; y < 40; ++y) {
    for (int x = 32; x < 64; ++x) std::fill_n(image.at(x, y), 3, uint8_t{200});
  }
  flawed.Photograph({"a", "1"}, "cam", &image);
  for (int x = 24; x < 40; ++x) {
    const double expected =
        LinearFromSrgb(200 / 255.0f) * 0.5 * (1 + std::erf((x + 0.5 - 32) / (sigma * std::sqrt(2))));
    EXPECT_NEAR(LinearFromSrgb(*image.at(x, 20) / 255.0f), expected, 0.01) << x;
  }
}

TEST(ImperfectionsTest, WrongOptionsAreErrors) {
  EXPECT_THAT(ErrorOf([] { ImperfectionOptions{.tracking_noise_mm = -1}.Check(); }), testing::HasSubstr("tracking"));
  EXPECT_THAT(ErrorOf([] { ImperfectionOptions{.lens_blur_px = 1e9}.Check(); }), testing::HasSubstr("blur"));
  EXPECT_THAT(ErrorOf([] { ImperfectionOptions{.colour_gain = NAN}.Check(); }), testing::HasSubstr("gains"));
}

}  // namespace
}  // namespace likeness
