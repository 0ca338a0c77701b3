#include "likeness/render/portrait.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "likeness/base/error.h"

namespace likeness {
namespace {

constexpr double kMargin = 0.06;  // of the picture, on every side
constexpr double kMostElevationDeg = 89;

}  // namespace

Eigen::Vector3d ViewDirection(double azimuth_deg, double elevation_deg) {
  const double azimuth = azimuth_deg * M_PI / 180, elevation = elevation_deg * M_PI / 180;
  return {std::sin(azimuth) * std::cos(elevation), std::sin(elevation), std::cos(azimuth) * std::cos(elevation)};
}

void PortraitOptions::Check() const {
  if (!std::isfinite(azimuth_deg)) throw Error("the azimuth is no finite number");
  if (!(std::abs(elevation_deg) <= kMostElevationDeg)) {
    throw Error("the elevation must be -{0} ... {0} degrees, not {1}", kMostElevationDeg, elevation_deg);
  }
  for (const int side : {width, height}) {
    if (side < 16 || side > 16384) throw Error("a picture has 16 ... 16384 pixels a side, not {}", side);
  }
  if (!(focal_px >= 0) || !std::isfinite(focal_px)) throw Error("the focal length must be positive, not {}", focal_px);
  if (!(distance_mm >= 300 && distance_mm <= 1e6)) {
    throw Error("the camera must stand 300 mm to 1 km away, not {} mm", distance_mm);
  }
}

Camera PortraitCamera(const Vertices& vertices_in_head, const MeshTopology& topology, const PortraitOptions& options) {
  options.Check();
  LIKENESS_CHECK(vertices_in_head.rows() == topology.vertex_count && !topology.triangles.empty());
  Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::max()), high = -low;
  const auto for_corners = [&](const auto& visit) {
    for (const Eigen::Vector3i& triangle : topology.triangles) {
      for (const int i : triangle) visit(Eigen::Vector3d(vertices_in_head.row(i).transpose().cast<double>()));
    }
  };
  for_corners([&](const Eigen::Vector3d& point) {
    low = low.min(point.array());
    high = high.max(point.array());
  });
  const Eigen::Vector3d middle = (low + high).matrix() / 2;
  const Eigen::Vector3d direction = ViewDirection(options.azimuth_deg, options.elevation_deg);
  Camera camera = LookAt(middle + options.distance_mm * direction, middle, Eigen::Vector3d::UnitY(), 1, options.width,
                         options.height);
  camera.name = "portrait";
  double focal = options.focal_px;
  if (focal == 0) {
    Eigen::Array2d reach = Eigen::Array2d::Constant(1e-9);  // tangents of the widest angles off the axis
    for_corners([&](const Eigen::Vector3d& point) {
      const Eigen::Vector3d in_cam = camera.cam_from_world * point;
      if (in_cam.z() > 1) reach = reach.max((in_cam.head<2>() / in_cam.z()).array().abs());
    });
    const Eigen::Array2d half_picture(options.width / 2.0, options.height / 2.0);
    focal = (half_picture * (1 - 2 * kMargin) / reach).minCoeff();
  }
  camera.intrinsics(0, 0) = camera.intrinsics(1, 1) = focal;
  return camera;
}

void ParseView(const std::string& text, double* azimuth_deg, double* elevation_deg) {
  const char* end = text.data() + text.size();
  const auto azimuth = std::from_chars(text.data(), end, *azimuth_deg);
  if (azimuth.ec == std::errc() && azimuth.ptr != end && *azimuth.ptr == ',') {
    const auto elevation = std::from_chars(azimuth.ptr + 1, end, *elevation_deg);
    if (elevation.ec == std::errc() && elevation.ptr == end && std::isfinite(*azimuth_deg) &&
        std::isfinite(*elevation_deg)) {
      return;
    }
  }
  throw Error("a view is AZIMUTH,ELEVATION in degrees, such as 30,-10; not '{}'", text);
}

}  // namespace likeness
