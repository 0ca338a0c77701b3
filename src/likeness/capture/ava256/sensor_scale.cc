#include "likeness/capture/ava256/sensor_scale.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "likeness/base/error.h"
#include "likeness/base/log.h"

namespace likeness {
namespace {

constexpr int kSensorWidth = 2668, kSensorHeight = 4096;
// The principal points of a real dome lie up to 0.12 from the middle; a K for twice the size puts them 0.25 away.
constexpr double kFarFromMiddle = 0.2;

// The size that K is calibrated for.
struct Calibrated {
  int multiple = 0;  // of the picture's size; 0: the sensor

  int Width(const Camera& c) const { return multiple == 0 ? kSensorWidth : multiple * c.width; }
  int Height(const Camera& c) const { return multiple == 0 ? kSensorHeight : multiple * c.height; }
};

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

bool Fits(const std::vector<SensorCamera>& sensors, const Calibrated& size) {
  std::vector<double> x, y;
  for (const SensorCamera& sensor : sensors) {
    const Camera& c = sensor.camera;
    if (c.width == 0) continue;
    // Pictures that were only made smaller keep the sensor's shape, up to rounding.
    const double across = static_cast<double>(size.Width(c)) / c.width,
                 down = static_cast<double>(size.Height(c)) / c.height;
    if (std::abs(across / down - 1) > 0.01 + 1.0 / c.width) return false;
    x.push_back(std::abs(c.intrinsics(0, 2) / size.Width(c) - 0.5));
    y.push_back(std::abs(c.intrinsics(1, 2) / size.Height(c) - 0.5));
  }
  return Median(x) < kFarFromMiddle && Median(y) < kFarFromMiddle;
}

std::optional<Calibrated> FindCalibrated(const std::vector<SensorCamera>& sensors) {
  for (const int multiple : {0, 1, 2, 4, 8}) {
    if (Fits(sensors, {multiple})) return Calibrated{multiple};
  }
  return std::nullopt;
}

void Tell(const std::filesystem::path& path, const Calibrated& size, const Camera& first) {
  const double ratio = static_cast<double>(size.Width(first)) / first.width;
  if (size.multiple == 0) {
    if (ratio != 2 && ratio != 4) {
      LogInfo("{}: the pictures have {} x {} pixels, which is not 1/2 or 1/4 of {} x {}; K is divided by {:.4g}",
              path.string(), first.width, first.height, kSensorWidth, kSensorHeight, ratio);
    }
  } else {
    LogWarning(
        "{}: K is not for the sensor of {} x {} pixels: by its principal points it is for {} times the pictures' "
        "{} x {}, and taken so",
        path.string(), kSensorWidth, kSensorHeight, size.multiple, first.width, first.height);
  }
}

}  // namespace

std::vector<Camera> ScaleToPictures(const std::filesystem::path& path_for_errors,
                                    const std::vector<SensorCamera>& sensors, PixelCentre centre) {
  const auto first =
      std::find_if(sensors.begin(), sensors.end(), [](const SensorCamera& s) { return s.camera.width > 0; });
  std::optional<Calibrated> size;
  if (first != sensors.end()) {
    size = FindCalibrated(sensors);
    if (!size) {
      throw FileError(
          path_for_errors,
          fmt::format("its principal points (camera {}: {:.0f}, {:.0f}) lie near the middle of no size that "
                      "fits pictures of {} x {}: are these the pictures of this calibration, upright?",
                      first->camera.name, first->camera.intrinsics(0, 2), first->camera.intrinsics(1, 2),
                      first->camera.width, first->camera.height));
    }
    Tell(path_for_errors, *size, first->camera);
  }
  std::vector<Camera> cameras;
  for (const SensorCamera& sensor : sensors) {
    Camera camera = sensor.camera;
    if (centre == PixelCentre::kZero) camera.intrinsics.block<2, 1>(0, 2).array() += 0.5;
    if (camera.width > 0) {
      camera.intrinsics.row(0) *= static_cast<double>(camera.width) / size->Width(camera);
      camera.intrinsics.row(1) *= static_cast<double>(camera.height) / size->Height(camera);
    }
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

}  // namespace likeness
