#include "likeness/simulate/rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "likeness/base/testing.h"
#include "likeness/simulate/performance.h"
#include "likeness/simulate/procedural_head.h"

namespace likeness {
namespace {

using Eigen::Vector3d;

constexpr double kDegrees = 180 / std::numbers::pi;

Vertices NeutralHead() { return MakeProceduralHead()->Pose(std::array<float, kExpressionCount>{}).tracked; }

TEST(RigTest, CamerasStandEvenlyInFrontAtTheAskedDistance) {
  const Vertices head = NeutralHead();
  const Vector3d centre = (head.colwise().minCoeff() + head.colwise().maxCoeff()).cast<double>().transpose() / 2;
  for (const int count : {1, 2, 6, 14, 40}) {
    RigOptions options;
    options.cameras = count;
    options.held_out_cameras = count / 5;
    const Rig rig = MakeRig(options, head);
    ASSERT_EQ(rig.cameras.size(), static_cast<size_t>(count));
    std::vector<double> nearest(rig.cameras.size(), 180);
    double left = -90, right = 90;
    for (size_t i = 0; i < rig.cameras.size(); ++i) {
      const Camera& camera = rig.cameras[i];
      const Vector3d offset = camera.CentreInWorld() - centre, d = offset.normalized();
      EXPECT_NEAR(offset.norm(), 1000, 1e-6);
      const double azimuth = std::atan2(d.x(), d.z()) * kDegrees, elevation = std::asin(d.y()) * kDegrees;
      EXPECT_LT(std::abs(azimuth), options.most_azimuth);
      EXPECT_GT(elevation, options.lowest_elevation);
      EXPECT_LT(elevation, options.highest_elevation);
      left = std::max(left, azimuth);
      right = std::min(right, azimuth);
      // Upright, and centred on the head.
      EXPECT_LT(camera.Project(centre + Vector3d(0, 10, 0)).y(), camera.Project(centre).y());
      EXPECT_NEAR(camera.Project(centre).x(), options.width / 2.0, 1e-6);
      EXPECT_NEAR(camera.Project(centre).y(), options.height / 2.0, 1e-6);
      for (size_t j = 0; j < rig.cameras.size(); ++j) {
        if (i == j) continue;
        const double angle = std::acos((rig.cameras[j].CentreInWorld() - centre).normalized().dot(d)) * kDegrees;
        nearest[i] = std::min(nearest[i], angle);
      }
    }
    if (count >= 6) {
      EXPECT_GT(left, 50);
      EXPECT_LT(right, -50);
      const auto [closest, farthest] = std::minmax_element(nearest.begin(), nearest.end());
      EXPECT_LT(*farthest, 2 * *closest);
    }
  }
}

TEST(RigTest, TheHeadFillsThePictureAndStaysInIt) {
  const auto head = MakeProceduralHead();
  RigOptions options;
  const Rig rig = MakeRig(options, NeutralHead());
  double fullest = 0;
  for (const PerformanceSegment& segment : BuiltInPerformance(40, 1).segments) {
    for (const PerformanceFrame& frame : segment.frames) {
      const Vertices tracked = head->Pose(frame.weights).tracked;
      const RigidTransform pose = frame.WorldFromHead();
      for (const Camera& camera : rig.cameras) {
        for (int v = 0; v < tracked.rows(); v += 5) {
          const Eigen::Vector2d pixel = camera.Project(pose * Vector3d(tracked.row(v).transpose().cast<double>()));
          EXPECT_TRUE(pixel.x() > 0 && pixel.x() < options.width && pixel.y() > 0 && pixel.y() < options.height)
              << camera.name << " " << segment.name << " " << pixel.transpose();
          fullest = std::max(
              {fullest, std::abs(2 * pixel.x() / options.width - 1), std::abs(2 * pixel.y() / options.height - 1)});
        }
      }
    }
  }
  EXPECT_GT(fullest, 0.84);
}

// Between training cameras: some stand further to each side, higher and lower.
TEST(RigTest, HeldOutCamerasStandAmongTheOthers) {
  for (const int count : {8, 12, 14, 16, 40}) {
    RigOptions options;
    options.cameras = count;
    options.held_out_cameras = count / 5;
    const Rig rig = MakeRig(options, NeutralHead());
    ASSERT_EQ(rig.held_out.size(), static_cast<size_t>(options.held_out_cameras));
    const auto is_held_out = [&](const Camera& camera) {
      return std::find(rig.held_out.begin(), rig.held_out.end(), camera.name) != rig.held_out.end();
    };
    for (const Camera& camera : rig.cameras) {
      if (!is_held_out(camera)) continue;
      int left = 0, right = 0, above = 0, below = 0;
      double nearest = 180;
      for (const Camera& other : rig.cameras) {
        if (is_held_out(other)) continue;
        const Vector3d a = camera.CentreInWorld(), b = other.CentreInWorld();
        left += std::atan2(b.x(), b.z()) > std::atan2(a.x(), a.z()) ? 1 : 0;
        right += std::atan2(b.x(), b.z()) < std::atan2(a.x(), a.z()) ? 1 : 0;
        above += b.y() > a.y() ? 1 : 0;
        below += b.y() < a.y() ? 1 : 0;
        nearest = std::min(nearest, std::acos(a.normalized().dot(b.normalized())) * kDegrees);
      }
      EXPECT_TRUE(left > 0 && right > 0 && above > 0 && below > 0) << count << " " << camera.name;
      EXPECT_LT(nearest, 50) << count << " " << camera.name;
    }
  }
}

TEST(RigTest, WrongOptionsAreErrors) {
  const Vertices head = NeutralHead();
  const auto error = [&](auto change) {
    RigOptions options;
    change(&options);
    return ErrorOf([&] { MakeRig(options, head); });
  };
  EXPECT_NE(error([](RigOptions* o) { o->cameras = 0; }), "");
  EXPECT_NE(error([](RigOptions* o) { o->held_out_cameras = o->cameras; }), "");
  EXPECT_NE(error([](RigOptions* o) { o->held_out_cameras = -1; }), "");
  EXPECT_NE(error([](RigOptions* o) { o->width = 0; }), "");
  EXPECT_NE(error([](RigOptions* o) { o->distance_mm = -5; }), "");
  EXPECT_NE(error([](RigOptions* o) { o->lowest_elevation = 60; }), "");
}

}  // namespace
}  // namespace likeness
