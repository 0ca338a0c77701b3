#include "likeness/xr/eyes.h"

#include <Eigen/Geometry>
#include <cmath>

namespace likeness {
namespace {

constexpr double kMmPerMetre = 1000;

}  // namespace

RigidTransform FromXrPose(const XrPosef& pose) {
  const XrQuaternionf& q = pose.orientation;
  const Eigen::Quaterniond rotation(q.w, q.x, q.y, q.z);
  const Eigen::Vector3d metres(pose.position.x, pose.position.y, pose.position.z);
  return {rotation.normalized().toRotationMatrix(), metres * kMmPerMetre};
}

Camera CameraOfEye(const XrPosef& local_from_eye, const XrFovf& field, int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  // Tangents are positive to the right and up; an image's rows go down.
  const double left = std::tan(field.angleLeft), right = std::tan(field.angleRight);
  const double up = std::tan(field.angleUp), down = std::tan(field.angleDown);
  const double focal_x = width / (right - left), focal_y = height / (up - down);
  camera.intrinsics << focal_x, 0, -left * focal_x, 0, focal_y, up * focal_y, 0, 0, 1;
  const RigidTransform cam_from_eye = {Eigen::Vector3d(1, -1, -1).asDiagonal(), Eigen::Vector3d::Zero()};
  camera.cam_from_world = cam_from_eye * FromXrPose(local_from_eye).Inverse();
  return camera;
}

RigidTransform PlaceBefore(const RigidTransform& local_from_viewer, double distance_mm,
                           const Eigen::Vector3d& target_in_world) {
  // The viewer's x axis stays level when one looks up or down, be it straight up.
  const Eigen::Vector3d right = local_from_viewer.rotation.col(0);
  const Eigen::Vector3d back = Eigen::Vector3d(right.x(), 0, right.z()).cross(Eigen::Vector3d::UnitY());
  const double length = back.norm();
  // Somebody who lies on the side has no level x axis, and looks along their z axis.
  const Eigen::Vector3d z =
      length > 0.5
          ? Eigen::Vector3d(back / length)
          : Eigen::Vector3d(local_from_viewer.rotation(0, 2), 0, local_from_viewer.rotation(2, 2)).normalized();
  RigidTransform local_from_world;
  local_from_world.rotation << Eigen::Vector3d::UnitY().cross(z), Eigen::Vector3d::UnitY(), z;
  local_from_world.translation =
      local_from_viewer.translation - distance_mm * z - local_from_world.rotation * target_in_world;
  return local_from_world;
}

std::optional<PanelHit> HitPanel(const RigidTransform& local_from_aim, const RigidTransform& local_from_panel) {
  const RigidTransform panel_from_aim = local_from_panel.Inverse() * local_from_aim;
  const Eigen::Vector3d& from = panel_from_aim.translation;
  const Eigen::Vector3d along = -panel_from_aim.rotation.col(2);
  if (from.z() <= 0 || along.z() >= 0) return std::nullopt;
  const double distance = -from.z() / along.z();
  return PanelHit{(from + distance * along).head<2>(), distance};
}

}  // namespace likeness
