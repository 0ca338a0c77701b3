// Textures and statistics of a capture that stay true for a part of it.

#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "likeness/capture/capture.h"
#include "likeness/capture/layout.h"

namespace likeness {

struct TexturePlan {
  std::vector<std::pair<std::filesystem::path, std::filesystem::path>> files;  // from, to; those that exist
  std::vector<std::string> dropped;                                            // what is not carried and why
};

// What can be carried of a capture in the Multiface layout when these cameras and frames are taken.
//   resized  the images get another size: textures of the old ones say more than the new ones show
TexturePlan PlanTextures(const Capture& source, const CaptureLayout& out, const std::vector<Camera>& cameras,
                         const std::vector<FrameId>& frames, bool resized);

}  // namespace likeness
