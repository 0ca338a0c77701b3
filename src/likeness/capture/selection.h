// A part of a capture: some cameras, segments and frames.

#pragma once

#include <string>
#include <vector>

#include "likeness/capture/capture.h"

namespace likeness {

struct CaptureSelection {
  std::vector<std::string> cameras;   // names; empty: all
  std::vector<std::string> segments;  // names, or their beginnings with a '*' behind; empty: all
  std::string frames;                 // numbers within every segment, "120-480" or "120"; empty: all
  int every = 1;                      // of what is left, every n-th frame of a segment, its first among them
  int count = 0;                      // of what is left, so many over all, evenly spread; 0: all

  void Check() const;  // throws Error
};

// In the capture's order. Throws Error, naming the nearest known one, for a camera or segment that the capture lacks,
// and where nothing is left.
std::vector<Camera> SelectCameras(const Capture& capture, const CaptureSelection& selection);
std::vector<FrameId> SelectFrames(const Capture& capture, const CaptureSelection& selection);

// The split of the cameras that are left. Without a training camera there is no split: all train.
Split ReduceSplit(const Split& split, const std::vector<Camera>& cameras);

}  // namespace likeness
