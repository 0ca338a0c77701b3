// The small text files of the Multiface layout: camera calibration (KRT) and rigid transforms.

#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/capture/capture.h"

namespace likeness {

// Each parser has the writer of what it reads beside it. Numbers are written with the digits that a double needs to
// come back unchanged; names must be IsLayoutName().

// Nine lines a camera: its name, or `name width height`; K (3 lines, px); five distortion values, all 0; [R | t]
// (3 lines, world to camera, mm); an empty line. Widths and heights are 0 where the file does not give them. Throws
// Error, with the line, for wrong counts, numbers that are not finite, a K that is not upper triangular with positive
// focal lengths, an R that is no rotation, distorted cameras, and names that are unusable or used twice.
std::vector<Camera> ParseCalibration(const std::filesystem::path& path_for_errors, std::string_view text);
std::string CalibrationText(const std::vector<Camera>& cameras);  // without widths and heights

// Three lines of [R | t], mm.
RigidTransform ParseTransform(const std::filesystem::path& path_for_errors, std::string_view text);
std::string TransformText(const RigidTransform& transform);

// `<segment> <frame>` a line, as it stands: with frames whose files are absent, and perhaps with repetitions.
std::vector<FrameId> ParseFrameList(const std::filesystem::path& path_for_errors, std::string_view text);
std::string FrameListText(const std::vector<FrameId>& frames);

}  // namespace likeness
