#include "likeness/geometry/lens.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace likeness {
namespace {

using Polynomial = std::vector<double>;  // coefficients, constant first

Polynomial Product(const Polynomial& a, const Polynomial& b) {
  Polynomial product(a.size() + b.size() - 1, 0.0);
  for (size_t i = 0; i < a.size(); ++i) {
    for (size_t j = 0; j < b.size(); ++j) product[i + j] += a[i] * b[j];
  }
  return product;
}

// s times the derivative by s.
Polynomial Slope(Polynomial p) {
  for (size_t i = 0; i < p.size(); ++i) p[i] *= static_cast<double>(i);
  return p;
}

Polynomial Sum(Polynomial a, const Polynomial& b, double scale) {
  a.resize(std::max(a.size(), b.size()), 0.0);
  for (size_t i = 0; i < b.size(); ++i) a[i] += scale * b[i];
  return a;
}

// The smallest positive real root, by the eigenvalues of the companion matrix; infinity when there is none.
double SmallestPositiveRoot(Polynomial p) {
  while (!p.empty() && p.back() == 0) p.pop_back();
  double smallest = std::numeric_limits<double>::infinity();
  if (p.size() < 2) return smallest;
  const auto degree = static_cast<Eigen::Index>(p.size()) - 1;
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(degree, degree);
  companion.diagonal(-1).setOnes();
  for (Eigen::Index i = 0; i < degree; ++i) companion(i, degree - 1) = -p[static_cast<size_t>(i)] / p.back();
  if (!companion.allFinite()) return smallest;
  for (const std::complex<double>& root : companion.eigenvalues()) {
    const bool is_real = std::abs(root.imag()) <= 1e-9 * std::abs(root);
    if (is_real && root.real() > 0) smallest = std::min(smallest, root.real());
  }
  return smallest;
}

}  // namespace

bool Lens::IsPinhole() const {
  return model == Model::kPinhole ||
         (model == Model::kRadialTangential && std::all_of(k.begin(), k.end(), [](double v) { return v == 0; }));
}

std::string Lens::Describe() const {
  static constexpr const char* kNames[2][8] = {{"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"},
                                               {"k1", "k2", "k3", "k4", "", "", "", ""}};
  if (IsPinhole()) return "no distortion";
  const bool fisheye = model == Model::kFisheye;
  std::string text = fisheye ? "OpenCV fisheye" : "OpenCV radial-tangential";
  for (size_t i = 0; i < k.size(); ++i) {
    if (k[i] != 0) text += fmt::format(", {} {:g}", kNames[fisheye ? 1 : 0][i], k[i]);
  }
  return text;
}

Eigen::Vector2d Lens::Distort(const Eigen::Vector2d& ideal) const {
  const double x = ideal.x(), y = ideal.y(), r2 = ideal.squaredNorm();
  if (model == Model::kPinhole) return ideal;
  if (model == Model::kFisheye) {
    const double r = std::sqrt(r2);
    if (r < 1e-12) return ideal;
    const double t = std::atan(r), t2 = t * t;
    return ideal * (t / r * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3])))));
  }
  const double radial = (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / (1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
  return {x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
          y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y};
}

// For a radial model x g(r^2): g I + 2 g' x x^T.
Eigen::Matrix2d Lens::Jacobian(const Eigen::Vector2d& ideal) const {
  const double x = ideal.x(), y = ideal.y(), r2 = ideal.squaredNorm();
  if (model == Model::kPinhole) return Eigen::Matrix2d::Identity();
  if (model == Model::kFisheye) {
    const double r = std::sqrt(r2);
    if (r < 1e-12) return Eigen::Matrix2d::Identity();
    const double t = std::atan(r), t2 = t * t;
    const double bent = t * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
    const double slope = (1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])))) / (1 + r2);
    const Eigen::Vector2d along = ideal / r;
    return bent / r * Eigen::Matrix2d::Identity() + (slope - bent / r) * along * along.transpose();
  }
  const double above = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4])), below = 1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]));
  const double above_slope = k[0] + r2 * (2 * k[1] + r2 * 3 * k[4]);
  const double below_slope = k[5] + r2 * (2 * k[6] + r2 * 3 * k[7]);
  const double slope = (above_slope * below - above * below_slope) / (below * below);
  Eigen::Matrix2d tangential;
  tangential << 2 * k[2] * y + 6 * k[3] * x, 2 * k[2] * x + 2 * k[3] * y,  //
      2 * k[2] * x + 2 * k[3] * y, 6 * k[2] * y + 2 * k[3] * x;
  return above / below * Eigen::Matrix2d::Identity() + 2 * slope * ideal * ideal.transpose() + tangential;
}

double Lens::LargestRadius() const {
  if (model == Model::kPinhole) return std::numeric_limits<double>::infinity();
  if (model == Model::kFisheye) {
    const double t = std::sqrt(SmallestPositiveRoot({1, 3 * k[0], 5 * k[1], 7 * k[2], 9 * k[3]}));
    return t < std::numbers::pi / 2 ? std::tan(t) : std::numeric_limits<double>::infinity();
  }
  // With s = r^2 the radial part is r n(s) / d(s); its slope by r has the sign of (n + 2 s n') d - 2 s n d'. The first
  // zero of d is a pole, before which the slope may keep its sign.
  const Polynomial n = {1, k[0], k[1], k[4]}, d = {1, k[5], k[6], k[7]};
  const Polynomial slope = Sum(Product(Sum(n, Slope(n), 2), d), Product(n, Slope(d)), -2);
  return std::sqrt(std::min(SmallestPositiveRoot(slope), SmallestPositiveRoot(d)));
}

bool LensRange::Contains(const Eigen::Vector2d& ideal) const {
  return ideal.norm() < largest_radius_ && lens_.Jacobian(ideal).determinant() > 0;
}

std::optional<Eigen::Vector2d> LensRange::Undistort(const Eigen::Vector2d& distorted) const {
  constexpr double kExact = 1e-12;
  // The centre is in range for every lens; each step is halved until it stays there and comes nearer.
  Eigen::Vector2d ideal = Contains(distorted) ? distorted : Eigen::Vector2d::Zero();
  Eigen::Vector2d error = lens_.Distort(ideal) - distorted;
  for (int i = 0; i < 100 && error.norm() > kExact * (1 + distorted.norm()); ++i) {
    const Eigen::Vector2d step = lens_.Jacobian(ideal).inverse() * error;
    double size = 1;
    Eigen::Vector2d next = ideal - step;
    while (size > 1e-6 && (!Contains(next) || !((lens_.Distort(next) - distorted).norm() < error.norm()))) {
      size /= 2;
      next = ideal - size * step;
    }
    if (size <= 1e-6) break;
    ideal = next;
    error = lens_.Distort(ideal) - distorted;
  }
  if (!(error.norm() <= 1e-9 * (1 + distorted.norm()))) return std::nullopt;
  return ideal;
}

}  // namespace likeness
