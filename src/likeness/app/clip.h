// What `likeness render` shows: one frame of an avatar after another.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "likeness/app/command.h"
#include "likeness/avatar/avatar.h"
#include "likeness/avatar/conditions.h"
#include "likeness/geometry/rigid.h"

namespace likeness {

struct ClipOptions {
  std::string frame = "mean";
  std::filesystem::path code;         // one code, instead
  std::filesystem::path codes;        // codes one after another
  std::string segment;                // of the training frames
  std::filesystem::path performance;  // avatar/performance.h
  double turntable_s = 0;             // once around in so many seconds; 0: no turn
  double frames_per_s = 30;
  std::string identity;
  std::vector<std::string> conditions;

  // Throws UsageError.
  void Check() const;
};

// --frame, --code, --codes, --segment, --performance, --turntable, --fps, --identity, --condition
void AddClipFlags(Command* command, ClipOptions* options);

struct ClipFrame {
  std::vector<float> code;  // [latent]
  FrameConditions conditions;
  std::string segment, frame;      // of a training frame; empty: it is none
  RigidTransform world_from_head;  // how a performance has moved the head since its first frame; mm
  double azimuth_deg = 0;          // how far the camera has gone around, towards the subject's left
};

// A turntable turns while the frames play, over and again as long as it takes; a still face where there is one frame.
// Throws Error naming the file for codes that are not this avatar's.
std::vector<ClipFrame> MakeClip(const Avatar& avatar, const ClipOptions& options);

}  // namespace likeness
