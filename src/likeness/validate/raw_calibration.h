// KRT files and transforms as they stand, right or wrong: where capture/calibration.h refuses, this reads on.

#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace likeness {

struct RawCamera {
  std::string name;
  int line = 0;                   // of the name, 1-based
  int64_t width = 0, height = 0;  // px; 0 when not given
  Eigen::Matrix3d intrinsics;     // any numbers
  std::array<double, 5> distortion = {};
  Eigen::Matrix<double, 3, 4> cam_from_world;  // any numbers
};

struct RawCalibration {
  std::vector<RawCamera> cameras;  // those that could be read
  std::string problem;             // why reading stopped early; empty when it did not
};

// Nine lines a camera, as ParseCalibration takes them, with any finite numbers. Never throws.
RawCalibration ParseRawCalibration(const std::filesystem::path& path_for_errors, std::string_view text);

// Three lines of four finite numbers (a fourth line 0 0 0 1 is skipped). Throws Error.
Eigen::Matrix<double, 3, 4> ParseRawTransform(const std::filesystem::path& path_for_errors, std::string_view text);

}  // namespace likeness
