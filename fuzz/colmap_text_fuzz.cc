#include "fuzz.h"
#include "likeness/capture/calibration_formats/colmap.h"

namespace likeness {

// The two files of a model, with a line of '=' between them.
void fuzz::Run(std::string_view bytes) {
  constexpr std::string_view kBorder = "=\n";
  const size_t border = std::min(bytes.find(kBorder), bytes.size());
  const std::string_view images = bytes.substr(std::min(border + kBorder.size(), bytes.size()));
  const auto cameras = Parsed([&] { return ParseColmapText(kPath, bytes.substr(0, border), images); });
  if (cameras) CheckCameras(kPath, *cameras);
}

}  // namespace likeness
