#include "fuzz.h"
#include "likeness/capture/calibration_formats/colmap.h"

namespace likeness {

// The two files of a model, the first as long as the first two bytes say.
void fuzz::Run(std::string_view bytes) {
  if (bytes.size() < 2) return;
  const size_t wanted = static_cast<uint8_t>(bytes[0]) + 256 * static_cast<size_t>(static_cast<uint8_t>(bytes[1]));
  bytes.remove_prefix(2);
  const size_t border = std::min(wanted, bytes.size());
  const auto cameras = Parsed([&] { return ParseColmapBinary(kPath, bytes.substr(0, border), bytes.substr(border)); });
  if (cameras) CheckCameras(kPath, *cameras);
}

}  // namespace likeness
