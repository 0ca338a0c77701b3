// Finds and reads the calibration of another tool on disk.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "likeness/capture/calibration_formats/calibration.h"

namespace likeness {

// Kinds of calibration: "nerfstudio", "colmap", "opencv".
const std::vector<std::string>& CalibrationKinds();

// Reads a calibration of this kind; image and mask paths become such as can be opened.
//   nerfstudio  a transforms.json or its folder
//   colmap      a folder with cameras and images (.bin or .txt), or one that has it in sparse/0 or sparse; images in
//               `images`, beside the model or up to two folders above it, masks likewise in `masks` as NAME.png
//   opencv      a file, or a folder whose .yml, .yaml, .xml and .json are read together; `fisheye` where files do not
//               say which model their coefficients are of. No images: they come by a pattern.
// Throws Error that says what was looked for.
DistortedCameras ReadCalibration(const std::string& kind, const std::filesystem::path& source, bool fisheye);

}  // namespace likeness
