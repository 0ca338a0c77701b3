#include "fuzz.h"
#include "likeness/capture/calibration_formats/nerfstudio.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  const auto cameras = Parsed([&] { return ParseNerfstudio(kPath, bytes); });
  if (cameras) CheckCameras(kPath, *cameras);
}

}  // namespace likeness
