// How near one picture is to another, over the pixels that matter.

#pragma once

#include <cstdint>

#include "likeness/image/image.h"

namespace likeness {

// A sum of squared differences that can go on over many images, in 0 ... 255 units.
struct SquaredError {
  double sum = 0;
  int64_t count = 0;  // values: pixels x channels

  double Mean() const { return count > 0 ? sum / static_cast<double>(count) : 0; }
  SquaredError& operator+=(const SquaredError& other);
};

// Over all channels of the pixels where `mask` (1 channel) is not 0. Shapes must agree.
SquaredError MaskedSquaredError(const ImageU8& a, const ImageU8& b, const ImageU8& mask);

// 10 log10(255^2 / mse), decibels; infinite for 0.
double PsnrDb(double mse);

// Structural similarity (Wang et al. 2004) of the luma (0.299 R + 0.587 G + 0.114 B of the encoded values; grey images
// as they are): 11 x 11 Gaussian window, sigma 1.5, K1 = 0.01, K2 = 0.03, L = 255. Returns the mean over the pixels
// where `mask` is not 0, and 1 when there are none. Unlike the paper, which leaves out the border, windows reach only
// over masked pixels inside the image and their weights are made to sum to 1: what lies around the head has no say.
double MaskedSsim(const ImageU8& a, const ImageU8& b, const ImageU8& mask);

}  // namespace likeness
