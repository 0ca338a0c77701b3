#include "likeness/geometry/rigid.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <limits>

#include "likeness/base/error.h"

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

RigidTransform AlignRigidly(const Eigen::MatrixX3d& source, const Eigen::MatrixX3d& target) {
  LIKENESS_CHECK(source.rows() == target.rows() && source.rows() >= 3);
  const Eigen::RowVector3d source_mean = source.colwise().mean(), target_mean = target.colwise().mean();
  const Eigen::Matrix3d covariance = (target.rowwise() - target_mean).transpose() * (source.rowwise() - source_mean);
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  RigidTransform aligned;
  aligned.rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  aligned.translation = target_mean.transpose() - aligned.rotation * source_mean.transpose();
  return aligned;
}

}  // namespace likeness
