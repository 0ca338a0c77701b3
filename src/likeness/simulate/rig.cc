#include "likeness/simulate/rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "likeness/base/error.h"

namespace likeness {
namespace {

using Eigen::Vector3d;

constexpr double kRadians = std::numbers::pi / 180;
constexpr double kFilled = 0.84, kMostFilled = 0.95;
const double kFullFrameDiagonalMm = std::hypot(36.0, 24.0);

// Points spread evenly, by area, over the part of the sphere.
std::vector<Vector3d> AreaPoints(const RigOptions& options, int count) {
  const double low = std::sin(options.lowest_elevation * kRadians);
  const double high = std::sin(options.highest_elevation * kRadians);
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) {
    // The R2 sequence (Roberts 2018).
    const double a = std::fmod(0.5 + i * 0.7548776662466927, 1.0), b = std::fmod(0.5 + i * 0.5698402909980532, 1.0);
    const double azimuth = (2 * a - 1) * options.most_azimuth * kRadians;
    const double y = low + (high - low) * b, radius = std::sqrt(1 - y * y);
    points.emplace_back(radius * std::sin(azimuth), y, radius * std::cos(azimuth));
  }
  return points;
}

std::vector<Vector3d> SpreadDirections(const RigOptions& options) {
  const std::vector<Vector3d> area = AreaPoints(options, std::max(4000, 64 * options.cameras));
  std::vector<Vector3d> centres = AreaPoints(options, options.cameras);
  for (int iteration = 0; iteration < 60; ++iteration) {
    std::vector<Vector3d> sums(centres.size(), Vector3d::Zero());
    for (const Vector3d& point : area) {
      size_t nearest = 0;
      for (size_t c = 1; c < centres.size(); ++c) {
        if (point.dot(centres[c]) > point.dot(centres[nearest])) nearest = c;
      }
      sums[nearest] += point;
    }
    for (size_t c = 0; c < centres.size(); ++c) {
      if (sums[c].norm() > 0) centres[c] = sums[c].normalized();
    }
  }
  std::sort(centres.begin(), centres.end(),
            [](const Vector3d& a, const Vector3d& b) { return std::atan2(a.x(), a.z()) < std::atan2(b.x(), b.z()); });
  return centres;
}

// Cameras far from the border of the part, and far from each other.
std::vector<size_t> ChooseHeldOut(const std::vector<Vector3d>& directions, int count) {
  const auto azimuth = [&](size_t i) { return std::atan2(directions[i].x(), directions[i].z()); };
  const auto elevation = [&](size_t i) { return std::asin(directions[i].y()); };
  double left = -10, right = 10, top = -10, bottom = 10;
  for (size_t i = 0; i < directions.size(); ++i) {
    left = std::max(left, azimuth(i));
    right = std::min(right, azimuth(i));
    top = std::max(top, elevation(i));
    bottom = std::min(bottom, elevation(i));
  }
  // The outermost cameras come last: 1 is the border itself.
  const auto border = [&](size_t i) {
    return std::max(std::abs(2 * (azimuth(i) - right) / std::max(left - right, 1e-9) - 1),
                    std::abs(2 * (elevation(i) - bottom) / std::max(top - bottom, 1e-9) - 1));
  };
  std::vector<size_t> chosen;
  while (static_cast<int>(chosen.size()) < count) {
    size_t best = directions.size();
    double best_score = -1e9;
    for (size_t i = 0; i < directions.size(); ++i) {
      double away = 0.6;
      for (const size_t c : chosen) {
        away = std::min(away, std::acos(std::clamp(directions[i].dot(directions[c]), -1.0, 1.0)));
      }
      if (std::find(chosen.begin(), chosen.end(), i) != chosen.end()) continue;
      const double score = away - 2 * std::max(border(i) - 0.75, 0.0);
      if (score > best_score) {
        best_score = score;
        best = i;
      }
    }
    chosen.push_back(best);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace

void RigOptions::Check() const {
  if (cameras < 1 || cameras > 1000) throw Error("a rig has 1 to 1000 cameras, not {}", cameras);
  if (held_out_cameras < 0 || held_out_cameras >= cameras) {
    throw Error("{} of {} cameras cannot be held out: leave at least one to train with", held_out_cameras, cameras);
  }
  if (width < 16 || height < 16 || width > 8192 || height > 8192) {
    throw Error("images are 16 to 8192 pixels wide and high, not {} x {}", width, height);
  }
  if (!(distance_mm >= 300 && distance_mm <= 100000)) {
    throw Error("cameras stand 300 to 100000 mm away, not {}", distance_mm);
  }
  if (!(lens_mm == 0 || (lens_mm >= 5 && lens_mm <= 2000))) {
    throw Error("lenses are 5 to 2000 mm long (0: as the head needs), not {}", lens_mm);
  }
  if (!(most_azimuth > 0 && most_azimuth <= 180 && lowest_elevation < highest_elevation && lowest_elevation > -80 &&
        highest_elevation < 80)) {
    throw Error("the cameras' azimuth must lie in 0 to 180 degrees and their elevation in -80 to 80");
  }
}

Rig MakeRig(const RigOptions& options, const Vertices& head_in_world) {
  options.Check();
  LIKENESS_CHECK(head_in_world.rows() > 0);
  const Vector3d low = head_in_world.colwise().minCoeff().cast<double>();
  const Vector3d high = head_in_world.colwise().maxCoeff().cast<double>();
  const Vector3d centre = (low + high) / 2;
  const std::vector<Vector3d> directions = SpreadDirections(options);
  Rig rig;
  double most = 0;  // how far the head reaches from the principal point, in half images, with a focal length of 1 px
  for (const Vector3d& direction : directions) {
    Camera camera =
        LookAt(centre + options.distance_mm * direction, centre, Vector3d::UnitY(), 1, options.width, options.height);
    camera.name = fmt::format("cam{:02}", rig.cameras.size());
    for (int v = 0; v < head_in_world.rows(); ++v) {
      const Vector3d p = camera.cam_from_world * Vector3d(head_in_world.row(v).transpose().cast<double>());
      if (p.z() < 1) throw Error("the cameras stand inside the head: {} mm is too near", options.distance_mm);
      most = std::max(
          {most, std::abs(p.x() / p.z()) / (options.width / 2.0), std::abs(p.y() / p.z()) / (options.height / 2.0)});
    }
    rig.cameras.push_back(std::move(camera));
  }
  double focal_px = kFilled / most;
  if (options.lens_mm > 0) {
    const double diagonal_px = std::hypot(options.width, options.height);
    focal_px = options.lens_mm / kFullFrameDiagonalMm * diagonal_px;
    if (focal_px > kMostFilled / most) {
      throw Error("the head does not fit into images of a {} mm lens at {} mm: take {:.0f} mm or less, or step back",
                  options.lens_mm, options.distance_mm,
                  std::floor(kFilled / most / diagonal_px * kFullFrameDiagonalMm));
    }
  }
  for (Camera& camera : rig.cameras) {
    camera.intrinsics(0, 0) = camera.intrinsics(1, 1) = focal_px;
  }
  for (const size_t i : ChooseHeldOut(directions, options.held_out_cameras)) {
    rig.held_out.push_back(rig.cameras[i].name);
  }
  return rig;
}

}  // namespace likeness
