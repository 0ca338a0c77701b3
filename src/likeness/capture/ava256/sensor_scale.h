// From calibrations of a whole sensor to cameras of the pictures that were published.

#pragma once

#include <filesystem>
#include <vector>

#include "likeness/capture/ava256/tables.h"
#include "likeness/geometry/camera.h"

namespace likeness {

// Where the calibration has the centre of its first pixel.
enum class PixelCentre { kHalf, kZero };

// Scales K to the pictures' sizes, which stand in `sensors`' cameras (0 where a camera has no picture: it keeps K as it
// is). The size that K is for is told by evidence: principal points lie near the middle of the picture. Tried are the
// sensor of both captures, 2668 x 4096, and the pictures' own size times 1, 2, 4 and 8. Logs what was found unless it
// is one of the published scales, 1/4 and 1/2 of that sensor. Throws Error where nothing fits.
std::vector<Camera> ScaleToPictures(const std::filesystem::path& path_for_errors,
                                    const std::vector<SensorCamera>& sensors, PixelCentre centre);

}  // namespace likeness
