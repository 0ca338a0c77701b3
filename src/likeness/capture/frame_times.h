// When a capture's frames were taken, as far as their names tell.

#pragma once

#include <vector>

#include "likeness/capture/capture.h"

namespace likeness {

// Seconds from the first frame, strictly rising. Within a segment time passes as the frames' numbers count, or a frame
// at a time where names are no rising numbers; a segment begins one frame after the end of the one before.
//   frames             in the capture's order
//   frames_per_second  at which numbers count. Throws Error outside of 0.1 ... 1000
std::vector<double> FrameTimes(const std::vector<FrameId>& frames, double frames_per_second);

}  // namespace likeness
