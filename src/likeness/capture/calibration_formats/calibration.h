// What the readers of other tools' calibrations share.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "likeness/capture/undistort.h"

namespace likeness {

// Cameras in the source's own world and unit. Pixel centres are at + 0.5, as ours.
using DistortedCameras = std::vector<DistortedCamera>;

// Throws Error when cameras have focal lengths, sizes, rotations or numbers that cannot be, or there are none.
void CheckCameras(const std::filesystem::path& path_for_errors, const DistortedCameras& cameras);

// Makes a name for each camera from its image's path: the file's stem ("cam01" of images/cam01.png), or the folder's
// name where stems repeat (cam01/000001.png), or the whole path with '_' for '/'. Characters that a layout cannot hold
// become '_'. Throws Error when two cameras still have the same name.
void NameByImages(const std::filesystem::path& path_for_errors, DistortedCameras* cameras);

// Brings camera positions to millimetres.
void Scale(DistortedCameras* cameras, double mm_per_unit);

// How far, in the cameras' unit, they stand from the point that they look at (nearest to all optical axes, least
// squares); the median. 0 for fewer than two cameras, or parallel ones.
double DistanceToFocus(const DistortedCameras& cameras);

}  // namespace likeness
