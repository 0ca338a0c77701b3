// Against values worked out by hand.

#include "likeness/xr/eyes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace likeness {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// OpenXR's numbers are single precision: 1e-7 of some thousands of millimetres.
constexpr double kSmall = 1e-3;

XrPosef PoseAt(float x, float y, float z) { return {{0, 0, 0, 1}, {x, y, z}}; }

XrPosef Turned(const Vector3d& axis, double degrees, const XrVector3f& position) {
  const Eigen::Quaternionf q(Eigen::AngleAxisf(static_cast<float>(degrees * M_PI / 180), axis.cast<float>()));
  return {{q.x(), q.y(), q.z(), q.w()}, position};
}

void ExpectNear(const Vector3d& a, const Vector3d& b) { EXPECT_LT((a - b).norm(), kSmall) << a << "\nand\n" << b; }

TEST(FromXrPose, MakesMillimetres) {
  // A quarter turn about y, to the left: x goes to -z.
  const RigidTransform pose = FromXrPose(Turned(Vector3d::UnitY(), 90, {1, 2, 3}));
  ExpectNear(pose * Vector3d(10, 0, 0), {1000, 2000, 2990});
  ExpectNear(pose * Vector3d(0, 0, 10), {1010, 2000, 3000});
}

TEST(CameraOfEye, SeesUnequalAngles) {
  const XrFovf field = {-std::atan(1.0f), std::atan(0.5f), std::atan(0.8f), -std::atan(1.2f)};
  const Camera camera = CameraOfEye(PoseAt(0, 1.6f, 0), field, 300, 200);
  const auto project = [&](const Vector3d& point) { return camera.Project(point); };
  // A metre ahead (-z), 1 to the left fills columns 0 ... 200, 0.5 to the right 200 ... 300; 0.8 up is 80 rows.
  EXPECT_LT((project({0, 1600, -1000}) - Vector2d(200, 80)).norm(), kSmall);
  EXPECT_LT((project({-1000, 1600, -1000}) - Vector2d(0, 80)).norm(), kSmall);
  EXPECT_LT((project({500, 1600, -1000}) - Vector2d(300, 80)).norm(), kSmall);
  EXPECT_LT((project({0, 2400, -1000}) - Vector2d(200, 0)).norm(), kSmall);
  EXPECT_LT((project({0, 400, -1000}) - Vector2d(200, 200)).norm(), kSmall);
  ExpectNear(camera.CentreInWorld(), {0, 1600, 0});
}

TEST(CameraOfEye, TurnsWithTheHead) {
  const XrFovf field = {-0.7f, 0.7f, 0.7f, -0.7f};
  const Camera camera = CameraOfEye(Turned(Vector3d::UnitY(), 90, {0, 0, 0}), field, 200, 200);
  EXPECT_LT((camera.Project({-1000, 0, 0}) - Vector2d(100, 100)).norm(), kSmall);  // it looks to the left
}

TEST(PlaceBefore, StandsAtEyeHeightFacingTheViewer) {
  const RigidTransform viewer = FromXrPose(PoseAt(0.1f, 1.6f, 0.2f));
  const RigidTransform local_from_world = PlaceBefore(viewer, 1000, {0, 30, 10});
  ExpectNear(local_from_world * Vector3d(0, 30, 10), {100, 1600, -800});
  ExpectNear(local_from_world.rotation * Vector3d::UnitZ(), Vector3d::UnitZ());  // the nose points back
}

TEST(PlaceBefore, FollowsTheHeadingAlone) {
  // Looking to the left, the avatar stands there and its nose points to the right.
  const Vector3d ahead(-500, 1000, 0);
  for (const double nod : {-80.0, 0.0, 30.0, 90.0}) {
    RigidTransform viewer = FromXrPose(Turned(Vector3d::UnitY(), 90, {0, 1, 0}));
    viewer.rotation = viewer.rotation * FromXrPose(Turned(Vector3d::UnitX(), nod, {0, 0, 0})).rotation;
    const RigidTransform local_from_world = PlaceBefore(viewer, 500, Vector3d::Zero());
    ExpectNear(local_from_world.translation, ahead);
    ExpectNear(local_from_world.rotation * Vector3d::UnitZ(), Vector3d::UnitX());
    ExpectNear(local_from_world.rotation * Vector3d::UnitY(), Vector3d::UnitY());
  }
}

TEST(PlaceBefore, WorksForSomebodyWhoLiesOnTheSide) {
  const RigidTransform viewer = FromXrPose(Turned(Vector3d::UnitZ(), 90, {0, 0.5f, 0}));
  ExpectNear(PlaceBefore(viewer, 1000, Vector3d::Zero()).translation, {0, 500, -1000});
}

// The texture is decoded for these: each eye's own, in the space of the avatar's head.
TEST(ViewVectorOfEye, IsEachEyesOwn) {
  const XrFovf field = {-0.7f, 0.7f, 0.7f, -0.7f};
  const RigidTransform local_from_world = PlaceBefore(FromXrPose(PoseAt(0, 1.6f, 0)), 1000, Vector3d::Zero());
  const auto view = [&](const XrPosef& eye, const RigidTransform& world_from_head) {
    Camera camera = CameraOfEye(eye, field, 100, 100);
    camera.cam_from_world = camera.cam_from_world * local_from_world;
    return ViewVector(camera, world_from_head);
  };
  const double length = std::hypot(30, 1000);
  // The viewer's left eye looks at the subject's right side, -x.
  ExpectNear(view(PoseAt(-0.03f, 1.6f, 0), {}), Vector3d(-30, 0, 1000) / length);
  ExpectNear(view(PoseAt(0.03f, 1.6f, 0), {}), Vector3d(30, 0, 1000) / length);
  // From a metre above the head's height and as far away: 45 degrees.
  ExpectNear(view(PoseAt(0, 2.6f, 0), {}), Vector3d(0, std::sqrt(0.5), std::sqrt(0.5)));
  // A head that has turned a quarter to its left shows its right side.
  const RigidTransform turned = {RotationFromYawPitchRoll(M_PI / 2, 0, 0), Vector3d::Zero()};
  ExpectNear(view(PoseAt(0, 1.6f, 0), turned), -Vector3d::UnitX());
}

TEST(HitPanel, SaysWhereAndHowFar) {
  const RigidTransform panel = FromXrPose(PoseAt(1, 0, 0));
  const std::optional<PanelHit> hit = HitPanel(FromXrPose(PoseAt(1.03f, 0.02f, 0.5f)), panel);
  ASSERT_TRUE(hit.has_value());
  EXPECT_LT((hit->on_panel_mm - Vector2d(30, 20)).norm(), kSmall);
  EXPECT_NEAR(hit->distance_mm, 500, kSmall);
  // Looking 45 degrees down, it comes down as far as it goes ahead.
  const std::optional<PanelHit> lower = HitPanel(FromXrPose(Turned(Vector3d::UnitX(), -45, {1, 0, 0.1f})), panel);
  ASSERT_TRUE(lower.has_value());
  EXPECT_LT((lower->on_panel_mm - Vector2d(0, -100)).norm(), kSmall);
  EXPECT_NEAR(lower->distance_mm, 100 * std::sqrt(2.0), kSmall);
}

TEST(HitPanel, HasABackAndAFront) {
  const RigidTransform panel;
  EXPECT_FALSE(HitPanel(FromXrPose(Turned(Vector3d::UnitY(), 180, {0, 0, 0.5f})), panel).has_value());   // away
  EXPECT_FALSE(HitPanel(FromXrPose(Turned(Vector3d::UnitY(), 180, {0, 0, -0.5f})), panel).has_value());  // from behind
}

}  // namespace
}  // namespace likeness
