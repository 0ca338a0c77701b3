// Lens distortion in OpenCV's two models, and where each can be trusted. A position on the image plane at z = 1 is
// `ideal` as a pinhole sees it and `distorted` as the lens shows it; K takes either to pixels.

#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>
#include <string>

namespace likeness {

struct Lens {
  enum class Model { kPinhole, kRadialTangential, kFisheye };

  Model model = Model::kPinhole;
  // kRadialTangential: k1 k2 p1 p2 k3 k4 k5 k6 in OpenCV's order; distorted = ideal * (1 + k1 r^2 + k2 r^4 + k3 r^6) /
  //   (1 + k4 r^2 + k5 r^4 + k6 r^6) + (2 p1 x y + p2 (r^2 + 2 x^2), p1 (r^2 + 2 y^2) + 2 p2 x y).
  // kFisheye: k1 k2 k3 k4; |distorted| = t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8) with t = atan |ideal|.
  std::array<double, 8> k = {};

  // Nothing to undo: a pinhole, or a radial-tangential lens of zeros. (A fisheye of zeros still bends.)
  bool IsPinhole() const;
  std::string Describe() const;  // "OpenCV radial-tangential, k1 0.1 k2 ..."; without the zeros

  // OpenCV documentation, module calib3d ("Detailed Description" and "Fisheye camera model").
  Eigen::Vector2d Distort(const Eigen::Vector2d& ideal) const;
  // d distorted / d ideal.
  Eigen::Matrix2d Jacobian(const Eigen::Vector2d& ideal) const;

  // The largest |ideal| up to which the radial part grows; infinity when it always does. Beyond it a fitted polynomial
  // folds the picture back over itself.
  double LargestRadius() const;
};

// A lens whose range has been worked out, for use on many points.
class LensRange {
 public:
  explicit LensRange(const Lens& lens) : lens_(lens), largest_radius_(lens.LargestRadius()) {}

  // Whether the model is one to one around here: inside the largest radius, and not mirrored by the tangential part.
  bool Contains(const Eigen::Vector2d& ideal) const;

  // The inverse of Distort by Newton's method, to 1e-12; none where no point in range is shown there.
  std::optional<Eigen::Vector2d> Undistort(const Eigen::Vector2d& distorted) const;

  double largest_radius() const { return largest_radius_; }

 private:
  Lens lens_;
  double largest_radius_ = std::numeric_limits<double>::infinity();
};

}  // namespace likeness
