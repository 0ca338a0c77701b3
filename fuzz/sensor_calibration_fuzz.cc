// camera_calibration.json of Ava-256 and Goliath.

#include "fuzz.h"
#include "likeness/capture/ava256/tables.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  const auto sensors = Parsed([&] { return ParseSensorCalibration(kPath, bytes); });
  if (!sensors) return;
  for (const SensorCamera& sensor : *sensors) {
    LIKENESS_CHECK(RotationDefect(sensor.camera.cam_from_world.rotation) < 0.1);
    LIKENESS_CHECK(sensor.camera.intrinsics.allFinite());
    Camera scaled = sensor.camera;
    scaled.width = 667;
    scaled.height = 1024;
    LIKENESS_CHECK(!sensor.lens.IsPinhole() || sensor.LargestShiftPx(scaled) == 0);
  }
}

}  // namespace likeness
