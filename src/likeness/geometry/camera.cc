#include "likeness/geometry/camera.h"

#include <Eigen/Geometry>

#include "likeness/base/error.h"

namespace likeness {

Eigen::Vector2d Camera::Project(const Eigen::Vector3d& point_in_world) const {
  return (intrinsics * (cam_from_world * point_in_world)).hnormalized();
}

Eigen::Vector3d Camera::RayInWorld(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector3d ray_in_cam = intrinsics.triangularView<Eigen::Upper>().solve(pixel.homogeneous());
  return (cam_from_world.rotation.transpose() * ray_in_cam).normalized();
}

Camera Camera::Resized(int new_width, int new_height) const {
  LIKENESS_CHECK(width > 0 && height > 0);
  Camera resized = *this;
  resized.width = new_width;
  resized.height = new_height;
  resized.intrinsics.row(0) *= static_cast<double>(new_width) / width;
  resized.intrinsics.row(1) *= static_cast<double>(new_height) / height;
  return resized;
}

Camera LookAt(const Eigen::Vector3d& centre, const Eigen::Vector3d& target, const Eigen::Vector3d& up, double focal_px,
              int width, int height) {
  const Eigen::Vector3d forward = (target - centre).normalized();
  const Eigen::Vector3d right = forward.cross(up).normalized();
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.intrinsics << focal_px, 0, width / 2.0, 0, focal_px, height / 2.0, 0, 0, 1;
  camera.cam_from_world.rotation.row(0) = right;
  camera.cam_from_world.rotation.row(1) = forward.cross(right);
  camera.cam_from_world.rotation.row(2) = forward;
  camera.cam_from_world.translation = -(camera.cam_from_world.rotation * centre);
  return camera;
}

Eigen::Vector3d ViewVector(const Camera& camera, const RigidTransform& world_from_head) {
  return (world_from_head.Inverse() * camera.CentreInWorld()).normalized();
}

}  // namespace likeness
