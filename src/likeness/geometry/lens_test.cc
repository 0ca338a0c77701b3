#include "likeness/geometry/lens.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "likeness/base/random.h"
#include "likeness/geometry/rigid.h"

namespace likeness {
namespace {

Lens RadialTangential(std::array<double, 8> k) { return {Lens::Model::kRadialTangential, k}; }
Lens Fisheye(std::array<double, 8> k) { return {Lens::Model::kFisheye, k}; }

const std::array kLenses = {RadialTangential({-0.28, 0.09, 0.001, -0.0006, -0.012}),
                            RadialTangential({0.2, -0.05, -0.003, 0.002, 0.01, 0.12, 0.03, 0.001}),
                            Fisheye({-0.03, 0.005, -0.002, 0.0003}), Fisheye({}), RadialTangential({-0.4})};

// The largest radius by small steps: where the radial part stops growing.
double SlowLargestRadius(const Lens& lens, double until) {
  Lens radial = lens;
  if (lens.model == Lens::Model::kRadialTangential) radial.k[2] = radial.k[3] = 0;
  const double step = 1e-4;
  double last = 0;
  for (double r = step; r < until; r += step) {
    const double now = radial.Distort({r, 0}).x();
    if (now <= last) return r;
    last = now;
  }
  return std::numeric_limits<double>::infinity();
}

TEST(LensTest, FollowsTheFormulasOfTheDocumentation) {
  // Worked out by hand for x = 0.3, y = -0.4, r^2 = 0.25.
  const Lens lens = RadialTangential({0.1, 0.2, 0.01, 0.02, 0.4, 0.8, 1.6, 3.2});
  const double radial =
      (1 + 0.1 * 0.25 + 0.2 * 0.0625 + 0.4 * 0.015625) / (1 + 0.8 * 0.25 + 1.6 * 0.0625 + 3.2 * 0.015625);
  const Eigen::Vector2d distorted = lens.Distort({0.3, -0.4});
  EXPECT_NEAR(distorted.x(), 0.3 * radial + 2 * 0.01 * -0.12 + 0.02 * (0.25 + 0.18), 1e-15);
  EXPECT_NEAR(distorted.y(), -0.4 * radial + 0.01 * (0.25 + 0.32) + 2 * 0.02 * -0.12, 1e-15);
  // 45 degrees off the axis: t = pi / 4.
  const double t = std::numbers::pi / 4;
  const Eigen::Vector2d bent = Fisheye({0.1, 0.01, 0.001, 0.0001}).Distort({0, 1});
  EXPECT_NEAR(bent.y(),
              t + 0.1 * std::pow(t, 3) + 0.01 * std::pow(t, 5) + 0.001 * std::pow(t, 7) + 0.0001 * std::pow(t, 9),
              1e-15);
  EXPECT_EQ(bent.x(), 0);
}

TEST(LensTest, JacobiansMatchFiniteDifferences) {
  Random random(1);
  for (const Lens& lens : kLenses) {
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector2d at(random.Uniform(-0.6, 0.6), random.Uniform(-0.6, 0.6));
      Eigen::Matrix2d differences;
      for (int c = 0; c < 2; ++c) {
        const Eigen::Vector2d h = 1e-6 * Eigen::Vector2d::Unit(c);
        differences.col(c) = (lens.Distort(at + h) - lens.Distort(at - h)) / 2e-6;
      }
      EXPECT_LT((lens.Jacobian(at) - differences).cwiseAbs().maxCoeff(), 1e-8) << lens.Describe();
    }
  }
}

TEST(LensTest, UndistortInvertsDistortInItsWholeRange) {
  Random random(2);
  for (const Lens& lens : kLenses) {
    const LensRange range(lens);
    int tested = 0;
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector2d at(random.Uniform(-1.2, 1.2), random.Uniform(-1.2, 1.2));
      if (at.norm() > 0.98 * range.largest_radius() || !range.Contains(at)) continue;
      ++tested;
      const auto back = range.Undistort(lens.Distort(at));
      ASSERT_TRUE(back.has_value()) << lens.Describe() << " at " << at.transpose();
      EXPECT_LT((*back - at).norm(), 1e-8) << lens.Describe() << " at " << at.transpose();
    }
    EXPECT_GT(tested, 100) << lens.Describe();
  }
}

TEST(LensTest, KnowsWhereTheModelFolds) {
  // r + k r^3 turns at r = sqrt(-1 / (3 k)).
  EXPECT_NEAR(RadialTangential({-0.4}).LargestRadius(), std::sqrt(1 / 1.2), 1e-12);
  EXPECT_EQ(RadialTangential({0.4}).LargestRadius(), std::numeric_limits<double>::infinity());
  EXPECT_EQ(Lens().LargestRadius(), std::numeric_limits<double>::infinity());
  EXPECT_EQ(Fisheye({}).LargestRadius(), std::numeric_limits<double>::infinity());
  // t + k t^3 turns at t = sqrt(-1 / (3 k)), where the angle is t.
  EXPECT_NEAR(Fisheye({-0.5}).LargestRadius(), std::tan(std::sqrt(1 / 1.5)), 1e-12);
  // A pole: 1 - 0.5 r^2 = 0.
  EXPECT_NEAR(RadialTangential({0, 0, 0, 0, 0, -0.5}).LargestRadius(), std::sqrt(2.0), 1e-12);
  Random random(3);
  for (int i = 0; i < 30; ++i) {
    std::array<double, 8> k = {};
    for (const size_t j : {0, 1, 4, 5, 6, 7}) k[j] = random.Uniform(-0.5, 0.5);
    for (const Lens& lens : {RadialTangential(k), Fisheye({k[0], k[1], k[4], k[5]})}) {
      const double fast = lens.LargestRadius(), slow = SlowLargestRadius(lens, 3);
      if (fast > 2.99) {
        EXPECT_GT(slow, 2.98) << lens.Describe();
      } else {
        EXPECT_NEAR(fast, slow, 2e-4) << lens.Describe();
      }
    }
  }
}

TEST(LensTest, NothingIsShownBeyondTheFold) {
  const LensRange range(RadialTangential({-0.4}));
  const double edge = RadialTangential({-0.4}).Distort({range.largest_radius(), 0}).x();
  EXPECT_TRUE(range.Undistort({0.999 * edge, 0}).has_value());
  EXPECT_FALSE(range.Undistort({1.001 * edge, 0}).has_value());
  EXPECT_FALSE(range.Contains({1.01 * range.largest_radius(), 0}));
  EXPECT_FALSE(range.Contains({std::nan(""), 0}));
}

TEST(RigidTest, AlignRigidlyFindsTheTransformAndNeverMirrors) {
  Random random(4);
  Eigen::MatrixX3d source(20, 3);
  for (double& v : source.reshaped()) v = random.Uniform(-100, 100);
  const RigidTransform truth = {RotationFromYawPitchRoll(0.7, -1.1, 2.5), {100, -2000, 30}};
  Eigen::MatrixX3d target(20, 3);
  for (int i = 0; i < 20; ++i) target.row(i) = truth * source.row(i).transpose();
  const RigidTransform found = AlignRigidly(source, target);
  EXPECT_LT((found.rotation - truth.rotation).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LT((found.translation - truth.translation).cwiseAbs().maxCoeff(), 1e-10);
  Eigen::MatrixX3d mirrored = source;
  mirrored.col(0) *= -1;
  EXPECT_LT(RotationDefect(AlignRigidly(source, mirrored).rotation), 1e-12);
}

}  // namespace
}  // namespace likeness
