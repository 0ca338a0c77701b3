// The small text files of the Multiface layout: camera calibration (KRT) and rigid transforms.

#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "likeness/capture/capture.h"

namespace likeness {

// Nine lines a camera: its name, or `name width height`; K (3 lines, px); five distortion values, all 0; [R | t]
// (3 lines, world to camera, mm); an empty line. Widths and heights are 0 where the file does not give them. Throws
// Error, with the line, for wrong counts, numbers that are not finite, a K that is not upper triangular with positive
// focal lengths, an R that is no rotation, distorted cameras, and names that are unusable or used twice.
std::vector<Camera> ParseCalibration(const std::filesystem::path& path_for_errors, std::string_view text);

// Three lines of [R | t], mm.
RigidTransform ParseTransform(const std::filesystem::path& path_for_errors, std::string_view text);

// `<segment> <frame>` a line, as it stands: with frames whose files are absent, and perhaps with repetitions.
std::vector<FrameId> ParseFrameList(const std::filesystem::path& path_for_errors, std::string_view text);

}  // namespace likeness
