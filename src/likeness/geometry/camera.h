// Pinhole cameras in OpenCV's convention: x right, y down, z forward; pixel (0, 0) spans [0, 1) x [0, 1), so the centre
// of the first pixel is at (0.5, 0.5).

#pragma once

#include <Eigen/Core>
#include <string>

#include "likeness/geometry/rigid.h"

namespace likeness {

struct Camera {
  std::string name;
  int width = 0;                                             // px; 0 when not known yet
  int height = 0;                                            // px
  Eigen::Matrix3d intrinsics = Eigen::Matrix3d::Identity();  // K, px; upper triangular, K(2, 2) = 1
  RigidTransform cam_from_world;                             // mm

  Eigen::Vector3d CentreInWorld() const { return cam_from_world.Inverse().translation; }

  // Pixel position of a point in front of the camera (z > 0 in camera space).
  Eigen::Vector2d Project(const Eigen::Vector3d& point_in_world) const;

  // Unit direction, in world space, of the ray through a pixel position.
  Eigen::Vector3d RayInWorld(const Eigen::Vector2d& pixel) const;

  // The same view at another image size: K scales with the pixels.
  Camera Resized(int new_width, int new_height) const;
};

// A camera at `centre` that looks at `target`; `up` is the direction that appears upwards. The principal point is the
// image's centre and pixels are square.
Camera LookAt(const Eigen::Vector3d& centre, const Eigen::Vector3d& target, const Eigen::Vector3d& up, double focal_px,
              int width, int height);

// Unit direction from the head's centre (the origin of head space) to the camera, in head space:
// normalize(R_f^T (C - t_f)) with world_from_head = [R_f | t_f].
Eigen::Vector3d ViewVector(const Camera& camera, const RigidTransform& world_from_head);

}  // namespace likeness
