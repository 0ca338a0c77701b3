// Pictures at another size.

#pragma once

#include "likeness/image/image.h"

namespace likeness {

// Every new pixel is the mean of the area that it covers: for making smaller. Any size ratio, any channel count.
ImageU8 ResizeArea(const ImageU8& image, int width, int height);

// Samples between the four nearest pixel centres (which are at +0.5), the border repeated: for making larger.
ImageU8 ResizeBilinear(const ImageU8& image, int width, int height);

// The largest size of the same shape that fits in a box: area when it gets smaller, bilinear when larger.
ImageU8 FitInto(const ImageU8& image, int width, int height);

// Values are clamped to 0 ... 255 and rounded.
ImageU8 ToU8(const ImageF& image);
ImageF ToFloat(const ImageU8& image);

}  // namespace likeness
