// Rigid transforms. A transform that takes points of space A to space B is called b_from_a.

#pragma once

#include <Eigen/Core>

namespace likeness {

struct RigidTransform {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  // mm

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return rotation * point + translation; }
  RigidTransform operator*(const RigidTransform& other) const;
  RigidTransform Inverse() const;
};

// Rotation by Euler angles in radians, as head poses are given: first roll about z, then pitch about x, then yaw about
// y (R = Ry Rx Rz).
Eigen::Matrix3d RotationFromYawPitchRoll(double yaw, double pitch, double roll);

// How far a matrix is from a rotation: the largest entry of |R^T R - I|, and infinity when it mirrors.
double RotationDefect(const Eigen::Matrix3d& matrix);

// The rotation and translation that bring `source` nearest to `target` (n x 3 each, n >= 3, points in rows) in the
// sense of least squares: target_from_source. Kabsch 1976; never a reflection.
RigidTransform AlignRigidly(const Eigen::MatrixX3d& source, const Eigen::MatrixX3d& target);

}  // namespace likeness
