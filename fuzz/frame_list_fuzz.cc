#include "fuzz.h"
#include "likeness/capture/calibration.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  CheckRoundTrip(
      bytes, [](std::string_view text) { return ParseFrameList(kPath, text); }, FrameListText);
}

}  // namespace likeness
