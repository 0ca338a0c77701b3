#include "likeness/viewer/orbit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "likeness/base/error.h"
#include "likeness/render/portrait.h"
#include "likeness/render/stereo.h"

namespace likeness {
namespace {

constexpr double kMostElevationDeg = 89;
constexpr double kZoomStep = 0.12;   // share of the distance for each step of the wheel
constexpr double kFitMargin = 1.12;  // of the mesh's size
constexpr double kRadians = M_PI / 180;

double FocalPx(int height) { return height / 2.0 / std::tan(Orbit::kFieldDeg / 2 * kRadians); }

}  // namespace

void Orbit::Turn(double right_px, double down_px, int height_px) {
  azimuth_deg = std::remainder(azimuth_deg - 180 * right_px / height_px, 360);
  elevation_deg = std::clamp(elevation_deg + 180 * down_px / height_px, -kMostElevationDeg, kMostElevationDeg);
}

void Orbit::Pan(double right_px, double down_px, int height_px) {
  const Camera camera = CameraFor(height_px, height_px);
  const double mm_a_pixel = distance_mm / FocalPx(height_px);
  const Eigen::Vector3d moved_in_cam(-right_px * mm_a_pixel, -down_px * mm_a_pixel, 0);
  target_in_head += camera.cam_from_world.rotation.transpose() * moved_in_cam;
}

void Orbit::Zoom(double steps) {
  distance_mm = std::clamp(distance_mm * std::exp(-kZoomStep * steps), kNearestMm, kFarthestMm);
}

Camera Orbit::CameraFor(int width, int height) const {
  const Eigen::Vector3d direction = ViewDirection(azimuth_deg, elevation_deg);
  return LookAt(target_in_head + distance_mm * direction, target_in_head, Eigen::Vector3d::UnitY(), FocalPx(height),
                width, height);
}

Orbit OrbitAround(const Vertices& vertices_in_head, const MeshTopology& topology) {
  LIKENESS_CHECK(vertices_in_head.rows() == topology.vertex_count && !topology.triangles.empty());
  Eigen::Array3f low = Eigen::Array3f::Constant(std::numeric_limits<float>::max()), high = -low;
  for (const Eigen::Vector3i& triangle : topology.triangles) {
    for (const int i : triangle) {
      low = low.min(vertices_in_head.row(i).transpose().array());
      high = high.max(vertices_in_head.row(i).transpose().array());
    }
  }
  Orbit orbit;
  orbit.target_in_head = ((low + high) / 2).matrix().cast<double>();
  const Eigen::Array3d half = ((high - low) / 2).cast<double>();
  // The nearest parts of the mesh fill the most of the picture.
  const double distance = std::max(half.x(), half.y()) * kFitMargin / std::tan(Orbit::kFieldDeg / 2 * kRadians);
  orbit.distance_mm = std::clamp(distance + half.z() / 2, Orbit::kNearestMm, Orbit::kFarthestMm);
  return orbit;
}

std::vector<EyeView> EyesOf(const Orbit& orbit, int width, int height, bool stereo, double eye_distance_mm) {
  if (!stereo) return {{orbit.CameraFor(width, height), 0}};
  std::vector<EyeView> eyes;
  for (const double side : {-0.5, 0.5}) {
    const int x = side < 0 ? 0 : width / 2;
    const Camera middle = orbit.CameraFor(side < 0 ? width / 2 : width - width / 2, height);
    eyes.push_back({EyeCamera(middle, side * eye_distance_mm, orbit.distance_mm), x});
  }
  return eyes;
}

}  // namespace likeness
