// Captures in the Multiface layout (layout.h), which is also what we write.

#pragma once

#include <filesystem>
#include <memory>

#include "likeness/capture/capture.h"

namespace likeness {

// Whether the folder has the files that make it one: KRT and frame_list.txt.
bool IsMultiface(const std::filesystem::path& root);

// Known traps, and what happens:
//   frames listed but absent, or listed twice     skipped_frames() tells
//   numbers of frames that jump                   names are names
//   vertices without a face, fewer uvs than vertices   as they are; a triangle has indices of both kinds
//   .obj whose positions are not in head space    used for faces and texture coordinates alone, once
//   images of any size                            the size is in KRT, or in the header of a camera's first image
//   lens distortion, transforms that are not rigid, no .obj anywhere   Error
std::unique_ptr<Capture> OpenMultiface(const std::filesystem::path& root, const CaptureOptions& options);

}  // namespace likeness
