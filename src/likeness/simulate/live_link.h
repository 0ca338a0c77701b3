// Recordings of Epic's Live Link Face app: a CSV of 52 ARKit coefficients and head and eye angles over time.

#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "likeness/simulate/performance.h"

namespace likeness {

struct LiveLinkRecording {
  double frames_per_second = 0;
  // One a row; `number` is the row, from 0. Yaw, pitch and roll are the recorded ones; there is no shift.
  std::vector<PerformanceFrame> frames;
};

// Reads a header `Timecode,BlendShapeCount,EyeBlinkLeft,...` with all 52 coefficients in any order, HeadYaw, HeadPitch
// and HeadRoll in radians where present, and rows with a timecode HH:MM:SS:FF[.fraction]. The timecode's rate is the
// smallest usual one that its FF fit. Rows of no coefficients (the face was lost) are left out. Eyes follow the
// EyeLook* coefficients, other columns are ignored. Throws Error, with the line, for anything else: missing or doubled
// columns, wrong counts, numbers that are not finite, coefficients outside [0, 1] by more than 0.05 (smaller excess is
// clamped), angles beyond half a turn, time that runs backwards, fewer than two rows.
LiveLinkRecording ReadLiveLink(const std::filesystem::path& path);
LiveLinkRecording ParseLiveLink(const std::filesystem::path& path_for_errors, std::string_view text);

// `frames` frames spread evenly over the recording (all of them when it has fewer), cut into consecutive segments
// REC_01, REC_02, ... of which every fifth, from the third on, is held out. A recording whose head never turns gets the
// head motion of `seed`.
SimulatedPerformance PerformanceFromRecording(const LiveLinkRecording& recording, int frames, uint64_t seed);

}  // namespace likeness
