// Split files: which cameras and segments train.

#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/capture/capture.h"

namespace likeness {

// What a split file says, before it meets a capture. Both parts may be absent.
struct SplitNames {
  bool has_cameras = false;
  std::vector<std::string> train;
  std::vector<std::string> test;  // in published splits the same cameras as train
  bool has_segments = false;
  std::vector<std::string> segments;  // prefixes of held-out ones
};

// {"full": {"train": [...], "test": [...], "visual": [...]}, "segment": [...]}; other keys are left alone. Throws Error
// when the text is no JSON of this shape or has neither key.
SplitNames ParseSplit(const std::filesystem::path& path_for_errors, std::string_view text);

// Cameras in `train` train; those in `test` alone are held out; the rest is neither. Throws Error when no training
// camera is in the capture; names that it lacks are logged, as parts of a capture may be on this disk.
Split ResolveSplit(const std::filesystem::path& path_for_errors, const SplitNames& names,
                   const std::vector<Camera>& cameras);

// The split that a capture is opened with: options.split_file, otherwise `default_file` where it exists, otherwise all
// cameras train; options.test_segments_file replaces the held-out segments.
Split FindSplit(const std::filesystem::path& default_file, const CaptureOptions& options,
                const std::vector<Camera>& cameras);

// The text that ParseSplit and ResolveSplit take apart. As in published splits, test equals train when no camera is
// held out.
std::string SplitText(const Split& split);

}  // namespace likeness
