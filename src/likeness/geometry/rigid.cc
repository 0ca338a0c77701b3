#include "likeness/geometry/rigid.h"

#include <Eigen/Geometry>
#include <limits>

namespace likeness {

RigidTransform RigidTransform::operator*(const RigidTransform& other) const {
  return {rotation * other.rotation, rotation * other.translation + translation};
}

RigidTransform RigidTransform::Inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }

Eigen::Matrix3d RotationFromYawPitchRoll(double yaw, double pitch, double roll) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  return (AngleAxisd(yaw, Vector3d::UnitY()) * AngleAxisd(pitch, Vector3d::UnitX()) *
          AngleAxisd(roll, Vector3d::UnitZ()))
      .toRotationMatrix();
}

double RotationDefect(const Eigen::Matrix3d& matrix) {
  if (matrix.determinant() <= 0) return std::numeric_limits<double>::infinity();
  return (matrix.transpose() * matrix - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
}

}  // namespace likeness
