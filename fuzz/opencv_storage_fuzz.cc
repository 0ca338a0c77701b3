#include "fuzz.h"
#include "likeness/capture/calibration_formats/opencv_storage.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  const auto root = Parsed([&] { return ParseStorage(kPath, bytes); });
  if (!root) return;
  const auto cameras = Parsed([&] { return CamerasFromStorage({{kPath, *root}}); });
  if (cameras) CheckCameras(kPath, *cameras);
}

}  // namespace likeness
