// Which pixels of a camera image show something before its background, without a mask.

#pragma once

#include <optional>

#include "likeness/image/image.h"

namespace likeness {

// 255 where the image differs from the colour that its left, right and upper borders share, holes filled. None when the
// borders share no colour, or when nothing or everything would be foreground.
std::optional<ImageU8> FindForeground(const ImageU8& rgb);

// The luma's contrast against its surroundings within `foreground` (empty: everywhere): (L - mean) / (mean + 8), where
// the mean is over a blurred square of radius `radius_px`. 0 outside. 1 channel. Shading and exposure mostly cancel.
ImageF LocalContrast(const ImageU8& rgb, const ImageU8& foreground, int radius_px);

struct MaskOverlap {
  double a = 0, b = 0, both = 0;  // px
  double Union() const { return a + b - both; }
  double Iou() const { return Union() > 0 ? both / Union() : 0; }
};
MaskOverlap Overlap(const ImageU8& a, const ImageU8& b);

}  // namespace likeness
