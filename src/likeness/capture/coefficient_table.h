// Expression coefficients of a capture's frames, as truth/performance.csv of a simulated capture has them, or as a
// phone measured them beside the cameras:
//
//   segment,frame,eyeBlinkLeft,...,jawOpen,...
//   EXP_smile,000003,0.01,...,0.4,...
//
// Columns may stand in any order; other columns, and frames that the capture does not list, are left alone.

#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/capture/capture.h"

namespace likeness {

// For each frame the values of the named columns, in the order of the names. Throws Error naming the line for a column
// that is missing or doubled, a value that is not in [0, 1], and a frame that stands there twice.
std::map<FrameId, std::vector<float>> ParseCoefficientTable(const std::filesystem::path& path_for_errors,
                                                            std::string_view text, std::span<const std::string> names);
std::map<FrameId, std::vector<float>> ReadCoefficientTable(const std::filesystem::path& path,
                                                           std::span<const std::string> names);

// Where a simulated capture keeps them.
std::filesystem::path TrueCoefficients(const std::filesystem::path& capture_root);

}  // namespace likeness
