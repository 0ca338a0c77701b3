// Calibrations in OpenCV's FileStorage, as YAML (with or without the header %YAML:1.0), JSON or XML.
//
// OpenCV puts the first pixel's centre at (0, 0): half a pixel is added to the principal point here. R and T take the
// world to the camera: x_cam = R x_world + T (https://docs.opencv.org, calib3d); rotations may be vectors (Rodrigues).
// Programs name things as they like. Known names, in any case, are
//   K     camera_matrix, cameraMatrix, intrinsic_matrix, intrinsics, K, M
//   D     distortion_coefficients, distortion_coeffs, dist_coeffs, distCoeffs, distortion, dist, D
//   R     rotation_matrix, rotation, rot, R, rvec          T     translation_vector, translation, tvec, T
//   size  image_width, width, W; image_height, height, H; image_size [width, height]
//   lens  fisheye_model (0 or 1); distortion_model (fisheye and equidistant, or plumb_bob, rational_polynomial, ...)
// for one camera a file (named by the file); with an ending for several in one, or in a pair of files like
// intri.yml and extri.yml: K1, K_left, T_01; or in a map for each camera: {left: {K: ...}}. A stereo pair (M1 D1 M2 D2
// R T) has its world in the first camera; R1, R2, P1, P2 and Q, which rectify, are not needed. Distortion of 4, 5 or 8
// coefficients; thin prisms (12) and tilted sensors (14) only where those are zero.

#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/capture/calibration_formats/calibration.h"

namespace likeness {

struct StorageEntry;

// What a FileStorage holds, as a tree.
struct StorageNode {
  enum class Kind { kScalar, kList, kMap };
  Kind kind = Kind::kScalar;
  int line = 0;        // 1-based; 0 when not known
  std::string scalar;  // as it stands
  std::vector<StorageNode> items;
  std::vector<StorageEntry> entries;

  const StorageNode* Find(std::string_view key) const;
};

struct StorageEntry {
  std::string key;
  StorageNode node;
};

// Told apart by the first characters. Throws Error, with the line, for what is none of the three, for anchors and
// aliases (which FileStorage never writes), and for nesting deeper than 32.
StorageNode ParseStorage(const std::filesystem::path& path_for_errors, std::string_view bytes);

// One file with all that belongs to it.
struct StorageFile {
  std::filesystem::path path;
  StorageNode root;
};

// The cameras of some files together, in the order of their names. `fisheye`: lenses are OpenCV's fisheye where no file
// says so. Throws Error naming the file and what the camera lacks.
DistortedCameras CamerasFromStorage(const std::vector<StorageFile>& files, bool fisheye = false);

}  // namespace likeness
