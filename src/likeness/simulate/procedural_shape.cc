#include "likeness/simulate/procedural_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "likeness/geometry/rigid.h"

namespace likeness {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

double SmoothStep(double a, double b, double x) {
  const double t = std::clamp((x - a) / (b - a), 0.0, 1.0);
  return t * t * t * (10 + t * (6 * t - 15));
}

double Bump(double x, double width) { return std::exp(-0.5 * x * x / (width * width)); }

// Longitude of a grid line, radians: 0 in front, denser there.
double Longitude(double s) {
  const double x = 2 * s - 1;
  return kPi * (0.6 * x + 0.4 * x * x * x);
}

double Latitude(double t) {
  const double y = 2 * t - 1;
  return kPi / 2 * (0.75 * y + 0.25 * y * y * y);
}

// The head at rest without eyes and mouth.
Vector3d BasePoint(double s, double t) {
  const double longitude = Longitude(s), latitude = Latitude(t);
  const Vector3d d(std::cos(latitude) * std::sin(longitude), std::sin(latitude),
                   std::cos(latitude) * std::cos(longitude));
  Vector3d point(74 * d.x(), 108 * d.y(), 92 * d.z());
  // The jaw is narrower than the skull, the face flatter than an ellipsoid.
  const double low = SmoothStep(0.1, 1.0, -d.y());
  point.x() *= 1 - 0.22 * low;
  const double front = SmoothStep(0.0, 0.8, d.z());
  point.z() += front * (6 * low - 6 * Bump(d.y(), 0.5));
  // Nose, brows, cheekbones, chin.
  const double x = point.x(), y = point.y();
  double relief = 22 * Bump(x, 6 + 0.12 * std::max(0.0, 12 - y)) * SmoothStep(28, -8, y) * SmoothStep(-26, -10, y);
  relief += 5 * Bump(y - 30, 8) * Bump(std::abs(x) - 26, 20);
  relief -= 7 * Bump(y - 10, 10) * Bump(std::abs(x) - 31, 13);
  relief += 4 * Bump(y + 12, 12) * Bump(std::abs(x) - 38, 14);
  relief += 7 * Bump(y + 82, 12) * Bump(x, 18);
  point.z() += relief * SmoothStep(0.0, 0.3, d.z());
  return point;
}

// 1 on the rim of a rectangle and inside, falling to 0 at `reach` half-sizes away.
double Influence(double p, double q, double reach) {
  const double dp = std::max(std::abs(p) - 1, 0.0), dq = std::max(std::abs(q) - 1, 0.0);
  return 1 - SmoothStep(0, reach, std::hypot(dp, dq));
}

}  // namespace

ProceduralShape::ProceduralShape(std::span<const float, kExpressionCount> weights) : weights_(weights) {}

double ProceduralShape::Weight(const char* name) const { return weights_[static_cast<size_t>(ExpressionIndex(name))]; }

double ProceduralShape::Weight(const char* name, bool left) const {
  return Weight((std::string(name) + (left ? "Left" : "Right")).c_str());
}

Vector3d ProceduralShape::EyeCentre(bool left) const { return {left ? 31.0 : -31.0, 12, 62}; }

Eigen::Matrix3d ProceduralShape::Gaze(bool left) const {
  // A left eye that looks out turns to the subject's left, +x.
  const double out = Weight("eyeLookOut", left) - Weight("eyeLookIn", left);
  const double up = Weight("eyeLookUp", left) - Weight("eyeLookDown", left);
  return RotationFromYawPitchRoll((left ? 0.6 : -0.6) * out, -0.45 * up, 0);
}

Vector3d ProceduralShape::MoveWithJaw(const Vector3d& point, double share) const {
  const Vector3d hinge(0, -18, 5);
  const double angle = 0.30 * Weight("jawOpen") * share;
  const double side = 8 * (Weight("jawLeft") - Weight("jawRight")) * share;
  return hinge + RotationFromYawPitchRoll(0, angle, 0) * (point - hinge) + Vector3d(side, 0, 0);
}

Vector3d ProceduralShape::LipCentre() const { return {0, -42, BasePoint(0.5, 10.0 / 36).z() + 3}; }

// The lid opening: an almond on a sphere a little larger than the eyeball. q = -1 is the lower lid, 1 the upper one.
Vector3d ProceduralShape::EyePoint(bool left, double p, double q) const {
  const double blink = std::clamp(Weight("eyeBlink", left), 0.0, 1.0);
  const double look = Weight("eyeLookUp", left) - Weight("eyeLookDown", left);
  const double upper_open = 5.2 + 2.0 * Weight("eyeWide", left) + 1.8 * look;
  const double lower_open = 4.2 - 0.8 * look;
  const double almond = 1 - 0.92 * p * p;
  const double closed = -0.6 * lower_open;
  const double upper = almond * (upper_open + blink * (closed - upper_open));
  const double lower = almond * (-lower_open + blink * (closed - 0.15 + lower_open));
  const double x = 12.5 * p;
  const double y = lower + (upper - lower) * (q + 1) / 2;
  const double radius = kEyeballRadiusMm + 1;
  const double z = std::sqrt(std::max(radius * radius - std::min(x * x, 10.5 * 10.5) - y * y, 4.0));
  return EyeCentre(left) + Vector3d(x, y, z);
}

// Lips on the rim |q| = 1, the mouth's inside within.
Vector3d ProceduralShape::MouthPoint(double p, double q) const {
  const double pucker = std::max(Weight("mouthPucker"), 0.8 * Weight("mouthFunnel"));
  const double funnel = Weight("mouthFunnel");
  const Vector3d centre = LipCentre();
  const double half_width = 25 * (1 - 0.38 * pucker);
  const double shape = 1 - p * p;
  const double x = half_width * p;
  const double edge = (0.25 + 5 * funnel) * shape * std::clamp(q, -1.0, 1.0);
  const double inside = std::max(1 - q * q, 0.0);
  const double depth = 42 * (1 - 0.85 * p * p * p * p) * std::sqrt(inside);
  // Cheeks and palate part behind the lips.
  const double room = 13 * shape * std::sqrt(inside) * q;
  const double bulge = 7 * pucker - 9 * p * p;
  Vector3d point = centre + Vector3d(x, edge + room, bulge - depth);
  for (const bool left : {true, false}) {
    const double corner = SmoothStep(0.1, 1, left ? p : -p);
    const double smile = Weight("mouthSmile", left), frown = Weight("mouthFrown", left);
    point += corner * Vector3d((left ? 1 : -1) * (6 * smile + 2 * frown), 8 * smile - 7 * frown, -4 * smile);
  }
  // The corners stay half way, so that the open mouth is round.
  return MoveWithJaw(point, 0.5 + (SmoothStep(1, -1, q) - 0.5) * (1 - p * p * p * p));
}

Vector3d ProceduralShape::Point(double s, double t) const {
  const double mouth_p = kMouthRectangle.P(s), mouth_q = kMouthRectangle.Q(t);
  if (std::abs(mouth_p) <= 1 && std::abs(mouth_q) <= 1) return MouthPoint(mouth_p, mouth_q);
  const GridRectangle& eye = s > 0.5 ? kLeftEyeRectangle : kRightEyeRectangle;
  const bool left = s > 0.5;
  const double eye_p = eye.P(s), eye_q = eye.Q(t);
  if (std::abs(eye_p) <= 1 && std::abs(eye_q) <= 1) return EyePoint(left, eye_p, eye_q);

  const Vector3d base = BasePoint(s, t);
  Vector3d point = base;
  const double x = base.x(), y = base.y();
  const double front = SmoothStep(-10, 50, base.z());
  // Brows and cheeks.
  const double side_share = SmoothStep(-12, 12, left ? x : -x);
  const double brow_up = 6 * Weight("browInnerUp") * Bump(x, 20) +
                         6 * Weight("browOuterUp", left) * Bump(std::abs(x) - 40, 14) * side_share -
                         5 * Weight("browDown", left) * Bump(std::abs(x) - 25, 20) * side_share;
  point.y() += front * Bump(y - 34, 13) * brow_up;
  point +=
      front * 9 * Weight("cheekPuff") * Bump(y + 34, 18) * Bump(std::abs(x) - 44, 16) * Vector3d(left ? 1 : -1, 0, 0.6);
  // The jaw takes the chin along.
  const double jaw_share = SmoothStep(-36, -62, y) * SmoothStep(-25, 40, base.z());
  point = MoveWithJaw(point, jaw_share);
  // What surrounds a rim follows it.
  const auto follow = [&](const GridRectangle& r, double p, double q, double reach, auto rim) {
    const double influence = Influence(p, q, reach);
    if (influence == 0) return;
    const double p_rim = std::clamp(p, -1.0, 1.0), q_rim = std::clamp(q, -1.0, 1.0);
    const Vector3d base_rim = BasePoint(r.s0 + (p_rim + 1) / 2 * (r.s1 - r.s0), r.t0 + (q_rim + 1) / 2 * (r.t1 - r.t0));
    const Vector3d offset = rim(p_rim, q_rim) - base_rim;
    point += influence * (base + offset - point);
  };
  follow(eye, eye_p, eye_q, 1.6, [&](double p, double q) { return EyePoint(left, p, q); });
  follow(kMouthRectangle, mouth_p, mouth_q, 1.5, [&](double p, double q) { return MouthPoint(p, q); });
  return point;
}

}  // namespace likeness
