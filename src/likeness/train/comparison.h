// An evaluated image as people look at it: ground truth beside ours, with the squared difference as an inset.

#pragma once

#include <filesystem>
#include <vector>

#include "likeness/image/image.h"
#include "likeness/train/evaluate.h"

namespace likeness {

// Mean squared difference over the channels, in 0 ... 255 units squared, that is shown brightest in every picture, so
// that pictures of different runs can be compared.
inline constexpr float kDifferenceFullScale = 400;

// The part of an image that is shown, in pixels, and the corner for the inset.
struct Framing {
  int x = 0, y = 0, width = 0, height = 0;
  bool right = true, bottom = true;
};

// The mask's bounding box with a margin; the whole image where the mask is empty. The inset goes where it covers the
// fewest head pixels.
Framing HeadFraming(const ImageU8& mask);
// The whole image; for a video, whose frames must not jump.
Framing WholeFraming(const ImageU8& mask);

struct Comparison {
  ImageU8 truth;  // RGB
  // RGB; in one corner, a third of the width, the difference in heat colours, black outside the head pixels, which do
  // not count.
  ImageU8 ours;
};

// Both cut to the framing, then made smaller, where they are larger, to fit width x height.
Comparison Compare(const EvaluatedPicture& picture, const Framing& framing, int width = 640, int height = 800);

// The two side by side with captions and a legend of the difference. Of the same size for the same framing.
ImageU8 ComparisonPanel(const EvaluatedPicture& picture, const Framing& framing);

// Writes GROUP_SEGMENT_FRAME_CAMERA.png for every picture, and index.json, which lists them with their figures.
// Returns the paths of the PNG files.
std::vector<std::filesystem::path> WriteComparisons(const std::vector<EvaluatedPicture>& pictures,
                                                    const std::filesystem::path& folder);

}  // namespace likeness
