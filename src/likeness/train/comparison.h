// An evaluated image as people look at it: ground truth, ours, difference.

#pragma once

#include <filesystem>
#include <vector>

#include "likeness/image/image.h"
#include "likeness/train/evaluate.h"

namespace likeness {

// Mean absolute difference over the channels, in 0 ... 255 units, that is shown brightest in every picture, so that
// pictures of different runs can be compared.
inline constexpr float kDifferenceFullScale = 32;

struct Comparison {
  ImageU8 truth;       // RGB
  ImageU8 ours;        // RGB
  ImageU8 difference;  // heat colours; black outside the head pixels, which do not count
};

// All three cut to the head pixels with a margin, then made smaller, where they are larger, to fit width x height.
Comparison Compare(const EvaluatedPicture& picture, int width = 640, int height = 800);

// The three side by side with captions and a legend of the difference.
ImageU8 ComparisonPanel(const EvaluatedPicture& picture);

// Writes GROUP_SEGMENT_FRAME_CAMERA.png for every picture, and index.json, which lists them with their figures.
// Returns the paths of the PNG files.
std::vector<std::filesystem::path> WriteComparisons(const std::vector<EvaluatedPicture>& pictures,
                                                    const std::filesystem::path& folder);

}  // namespace likeness
