#include "likeness/capture/undistort.h"

#include <gtest/gtest.h>

#include <cmath>

#include "likeness/base/parallel.h"
#include "likeness/image/metrics.h"
#include "likeness/image/resize.h"

namespace likeness {
namespace {

// What the scene looks like in a direction (x, y, 1): smooth, and no period near a pixel.
double Scene(const Eigen::Vector2d& ideal, int channel) {
  return 128 + 100 * std::sin(21 * ideal.x() + channel) * std::cos(17 * ideal.y() - 0.4 * channel);
}

struct LensCase {
  const char* name;
  Lens lens;
};

class UndistortTest : public ::testing::Test {
 protected:
  static DistortedCamera MakeCamera(const Lens& lens) {
    DistortedCamera source;
    source.lens = lens;
    source.camera.width = 150;
    source.camera.height = 120;
    source.camera.intrinsics << 130, 0, 73.2, 0, 127, 61.9, 0, 0, 1;
    return source;
  }

  // The picture that the lens takes of the scene: every pixel by the iterative inverse of the model.
  static ImageU8 Photograph(const DistortedCamera& source) {
    ImageU8 image(source.camera.width, source.camera.height, 3);
    const LensRange range(source.lens);
    const Eigen::Matrix3d& k = source.camera.intrinsics;
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const auto ideal = range.Undistort({(x + 0.5 - k(0, 2)) / k(0, 0), (y + 0.5 - k(1, 2)) / k(1, 1)});
        for (int c = 0; c < 3 && ideal; ++c) image.at(x, y)[c] = static_cast<uint8_t>(std::lround(Scene(*ideal, c)));
      }
    }
    return image;
  }

  // The root mean square difference from the scene over valid pixels.
  static double Error(const ImageU8& image, const ImageU8& valid, const Camera& target) {
    double sum = 0;
    int count = 0;
    const Eigen::Matrix3d& k = target.intrinsics;
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        if (*valid.at(x, y) == 0) continue;
        for (int c = 0; c < 3; ++c, ++count) {
          const double truth = Scene({(x + 0.5 - k(0, 2)) / k(0, 0), (y + 0.5 - k(1, 2)) / k(1, 1)}, c);
          sum += std::pow(image.at(x, y)[c] - truth, 2);
        }
      }
    }
    return std::sqrt(sum / count);
  }

  const std::vector<LensCase> cases_ = {
      {"barrel", {Lens::Model::kRadialTangential, {-0.28, 0.09, 0.004, -0.003, -0.012}}},
      {"cushion", {Lens::Model::kRadialTangential, {0.25, 0.05, 0, 0, 0, 0.05}}},
      {"fisheye", {Lens::Model::kFisheye, {-0.03, 0.005, -0.002, 0.0003}}},
      {"shifted pinhole", {}},
  };
};

TEST_F(UndistortTest, BringsBackTheSceneThatALensDistorted) {
  for (const auto& [name, lens] : cases_) {
    const DistortedCamera source = MakeCamera(lens);
    Camera target = source.camera;
    if (lens.IsPinhole()) target.intrinsics(0, 2) += 3.5;
    const ImageU8 photograph = Photograph(source);
    const Undistorter undistorter(source, target);
    // The scene's curvature is below 100 * 21^2 / 130^2 = 2.6 a square pixel in x and 1.8 in y; bilinear sampling errs
    // by up to an eighth of their sum, and two roundings add 0.29 each.
    EXPECT_LT(Error(undistorter.Undistort(photograph), undistorter.valid(), target), 0.7) << name;
    if (!lens.IsPinhole()) {
      EXPECT_GT(Error(photograph, undistorter.valid(), target), 8) << name;
    }
  }
}

TEST_F(UndistortTest, SmallerTargetsDoNotAlias) {
  const DistortedCamera source = MakeCamera(cases_[0].lens);
  const Camera target = source.camera.Resized(30, 24);
  const Undistorter undistorter(source, target);
  EXPECT_GE(undistorter.samples(), 16);
  // A fine checkerboard must turn grey; one sample a pixel would make it 0 and 255.
  ImageU8 board(150, 120, 3);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 150; ++x) std::fill_n(board.at(x, y), 3, (x + y) % 2 == 0 ? 255 : 0);
  }
  const ImageU8 grey = undistorter.Undistort(board);
  for (int y = 2; y < 22; ++y) {
    for (int x = 2; x < 28; ++x) EXPECT_NEAR(grey.at(x, y)[1], 127.5, 40) << x << " " << y;
  }
  // Without distortion it is the mean over an area.
  const DistortedCamera plain = MakeCamera({});
  const ImageU8 photograph = Photograph(plain);
  const Undistorter shrink(plain, target);
  const double difference =
      MaskedSquaredError(shrink.Undistort(photograph), ResizeArea(photograph, 30, 24), shrink.valid()).Mean();
  EXPECT_LT(difference, 1);
}

TEST_F(UndistortTest, PixelsAreValidExactlyWhereTheirSourcesLieInside) {
  for (const auto& [name, lens] : cases_) {
    DistortedCamera source = MakeCamera(lens);
    // Off centre, so that something is cut off whichever way the lens bends.
    Camera target = source.camera;
    target.intrinsics(0, 2) += 20;
    target.intrinsics(1, 1) *= 0.8;
    const Undistorter undistorter(source, target);
    const int side = static_cast<int>(std::lround(std::sqrt(undistorter.samples())));
    int valid_pixels = 0;
    for (int y = 0; y < target.height; ++y) {
      for (int x = 0; x < target.width; ++x) {
        const Eigen::Matrix3d& kt = target.intrinsics;
        const Eigen::Matrix3d& ks = source.camera.intrinsics;
        double margin = 1e9;  // of the sample that comes nearest to the border, or lies furthest beyond it
        for (int s = 0; s < undistorter.samples(); ++s) {
          const int column = s % side, row = s / side;
          const double px = x + (column + 0.5) / side, py = y + (row + 0.5) / side;
          const Eigen::Vector2d bent = lens.Distort({(px - kt(0, 2)) / kt(0, 0), (py - kt(1, 2)) / kt(1, 1)});
          const double sx = ks(0, 0) * bent.x() + ks(0, 2), sy = ks(1, 1) * bent.y() + ks(1, 2);
          margin = std::min({margin, sx - 0.5, sy - 0.5, 149.5 - sx, 119.5 - sy});
        }
        if (std::abs(margin) < 2e-3) continue;
        EXPECT_EQ(*undistorter.valid().at(x, y), margin > 0 ? 255 : 0) << name << " " << x << " " << y;
        valid_pixels += margin > 0;
      }
    }
    EXPECT_GT(valid_pixels, 5000) << name;
    EXPECT_LT(valid_pixels, 18000) << name;
    EXPECT_FALSE(undistorter.all_valid()) << name;
  }
  EXPECT_TRUE(Undistorter(MakeCamera({}), MakeCamera({}).camera).all_valid());
}

TEST_F(UndistortTest, NothingIsValidBeyondTheFoldOfAPolynomial) {
  // Folds at |ideal| = 0.5: corners would show the middle again.
  const DistortedCamera source = MakeCamera({Lens::Model::kRadialTangential, {-1 / 0.75}});
  const Undistorter undistorter(source, source.camera);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 150; ++x) {
      const double radius = std::hypot((x + 0.5 - 73.2) / 130, (y + 0.5 - 61.9) / 127);
      EXPECT_EQ(*undistorter.valid().at(x, y), radius < 0.5 ? 255 : 0) << x << " " << y;
    }
  }
}

TEST_F(UndistortTest, MasksStayTwoValuedAndDoNotGrow) {
  const DistortedCamera source = MakeCamera(cases_[0].lens);
  const Undistorter undistorter(source, source.camera);
  EXPECT_EQ(undistorter.UndistortMask(ImageU8(150, 120, 1, 255)), undistorter.valid());
  ImageU8 half(150, 120, 1);
  for (int y = 0; y < 120; ++y) std::fill_n(half.row(y), 75, 255);
  const ImageU8 result = undistorter.UndistortMask(half), grey = undistorter.Undistort(half);
  for (size_t i = 0; i < result.values().size(); ++i) {
    EXPECT_EQ(result.values()[i], grey.values()[i] == 255 ? 255 : 0);
  }
}

TEST_F(UndistortTest, TheSameForAnyNumberOfThreads) {
  const DistortedCamera source = MakeCamera(cases_[2].lens);
  const ImageU8 photograph = Photograph(source);
  SetThreadCount(1);
  const ImageU8 one = Undistorter(source, source.camera).Undistort(photograph);
  SetThreadCount(3);
  EXPECT_EQ(Undistorter(source, source.camera).Undistort(photograph), one);
  SetThreadCount(0);
}

TEST_F(UndistortTest, AnImageThatNeedsNoChangeIsKnown) {
  const DistortedCamera plain = MakeCamera({});
  const ImageU8 photograph = Photograph(plain);
  EXPECT_TRUE(IsSameImage(plain, plain.camera));
  EXPECT_EQ(Undistorter(plain, plain.camera).Undistort(photograph), photograph);
  EXPECT_FALSE(IsSameImage(plain, plain.camera.Resized(75, 60)));
  EXPECT_FALSE(IsSameImage(MakeCamera(cases_[0].lens), plain.camera));
  EXPECT_FALSE(IsSameImage(MakeCamera({Lens::Model::kFisheye, {}}), plain.camera));
}

}  // namespace
}  // namespace likeness
