#include "likeness/geometry/camera.h"

#include <gtest/gtest.h>

namespace likeness {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Camera Example() { return LookAt({100, 50, 1000}, {0, 0, 0}, {0, 1, 0}, 900, 640, 480); }

TEST(CameraTest, TheTargetIsTheImageCentreAndUpIsUp) {
  const Camera camera = Example();
  EXPECT_LT((camera.Project({0, 0, 0}) - Vector2d(320, 240)).norm(), 1e-9);
  EXPECT_LT(camera.Project({0, 10, 0}).y(), 240);  // up is a smaller row
  EXPECT_GT(camera.Project({10, 0, 0}).x(), 320);  // seen from +z, +x is to the right
  EXPECT_LT((camera.CentreInWorld() - Vector3d(100, 50, 1000)).norm(), 1e-9);
  EXPECT_LT(RotationDefect(camera.cam_from_world.rotation), 1e-12);
}

TEST(CameraTest, RaysInvertProjection) {
  const Camera camera = Example();
  const Vector3d point(-30, 70, 55);
  const Vector3d ray = camera.RayInWorld(camera.Project(point));
  EXPECT_LT((ray - (point - camera.CentreInWorld()).normalized()).norm(), 1e-12);
}

TEST(CameraTest, ResizingScalesPixels) {
  const Camera camera = Example(), half = camera.Resized(320, 240);
  const Vector3d point(12, 34, 56);
  EXPECT_LT((half.Project(point) * 2 - camera.Project(point)).norm(), 1e-9);
}

TEST(ViewVectorTest, RemovesTheHeadPose) {
  const Camera camera = Example();
  const RigidTransform world_from_head = {RotationFromYawPitchRoll(0.3, -0.2, 0.1), {10, 20, 30}};
  const Vector3d view = ViewVector(camera, world_from_head);
  const Vector3d direction = camera.CentreInWorld() - world_from_head.translation;
  EXPECT_LT((world_from_head.rotation * view - direction.normalized()).norm(), 1e-12);
}

TEST(RigidTransformTest, InverseAndComposition) {
  const RigidTransform a = {RotationFromYawPitchRoll(1, 2, 3), {1, 2, 3}};
  const RigidTransform b = {RotationFromYawPitchRoll(-1, 0.5, 0.2), {-4, 5, 6}};
  const Vector3d p(7, 8, 9);
  EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-12);
  EXPECT_LT((a.Inverse() * (a * p) - p).norm(), 1e-12);
  // Yaw turns the nose (+z) towards the subject's left (+x).
  EXPECT_GT((RotationFromYawPitchRoll(0.1, 0, 0) * Vector3d::UnitZ()).x(), 0);
}

}  // namespace
}  // namespace likeness
