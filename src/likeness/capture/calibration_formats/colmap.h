// COLMAP's sparse models, text and binary, read and written.
//
// As https://colmap.github.io/format.html has it: cameras.{txt,bin} hold models and sizes, images.{txt,bin} the
// world-to-camera pose of every image as quaternion (w x y z) and translation, and the image's name. Axes are OpenCV's
// and ours (x right, y down, z forward); the first pixel's centre is at (0.5, 0.5), as ours. The unit is arbitrary.
// Not read: points3D, rigs and frames, which cameras do not need; 2D points are skipped.

#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/capture/calibration_formats/calibration.h"

namespace likeness {

struct ColmapFiles {
  std::string cameras, images, points;  // whole files
};

// One camera an image: its name from the image's (NameByImages), its image path as COLMAP names it. `path_for_errors`
// is the model's folder. Known models: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, OPENCV_FISHEYE,
// FULL_OPENCV; others are named and refused. Throws Error, in text with the line; a count in a binary file is believed
// only as far as the file reaches.
DistortedCameras ParseColmapText(const std::filesystem::path& path_for_errors, std::string_view cameras,
                                 std::string_view images);
DistortedCameras ParseColmapBinary(const std::filesystem::path& path_for_errors, std::string_view cameras,
                                   std::string_view images);

// A point for other tools to show.
struct ColouredPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::array<uint8_t, 3> rgb = {};
};

// PINHOLE models with ids from 1 in the cameras' order, and points without tracks. Throws Error for a lens, or a K with
// skew, which PINHOLE cannot hold.
ColmapFiles FormatColmapText(const DistortedCameras& cameras, const std::vector<ColouredPoint>& points);
ColmapFiles FormatColmapBinary(const DistortedCameras& cameras, const std::vector<ColouredPoint>& points);

}  // namespace likeness
