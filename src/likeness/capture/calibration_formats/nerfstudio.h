// nerfstudio's transforms.json (also of instant-ngp and many others), read and written.
//
// As https://docs.nerf.studio/quickstart/data_conventions.html has it: transform_matrix is camera-to-world with OpenGL
// axes (x right, y up, z back), pixel centres are at + 0.5 as ours, k1 k2 p1 p2 k3 (OPENCV) or k1 to k4
// (OPENCV_FISHEYE) are OpenCV's. The unit of length is arbitrary. Its tools write the pose T and the scale s that they
// applied to the original world: saved = s (T original); both are undone here, so that cameras stand where the
// calibration put them.
// Not read: depth maps, other camera models (named and refused), camera_angle_x without fl_x gives fl_x as in NeRF's
// first data sets.

#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "likeness/capture/calibration_formats/calibration.h"

namespace likeness {

// Image and mask paths as the file gives them, usually relative to its folder. Throws Error naming the frame.
DistortedCameras ParseNerfstudio(const std::filesystem::path& path_for_errors, std::string_view bytes);

// The same for writing: intrinsics with every frame, distortion of zero, file_path and mask_path from the cameras
// (relative to the file), and the path of a point cloud. Throws Error for a lens, or a K with skew, which the format
// cannot hold.
std::string FormatNerfstudio(const DistortedCameras& cameras, const std::string& ply_file_path);

}  // namespace likeness
