#include <algorithm>

#include "fuzz.h"
#include "likeness/simulate/live_link.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  const auto recording = Parsed([&] { return ParseLiveLink(kPath, bytes); });
  if (!recording) return;
  LIKENESS_CHECK(recording->frames.size() >= 2 && recording->frames_per_second > 0);
  for (const PerformanceFrame& frame : recording->frames) {
    LIKENESS_CHECK(frame.time_s >= 0);
    for (const float weight : frame.weights) LIKENESS_CHECK(weight >= 0 && weight <= 1);
  }
  const int frames = static_cast<int>(recording->frames.size());
  for (const int wanted : {2, frames, 2 * frames}) {
    LIKENESS_CHECK(PerformanceFromRecording(*recording, wanted, 1).FrameCount() == std::min(wanted, frames));
  }
}

}  // namespace likeness
