// How a network's weights lie in memory for dense products, on the processor and on a GPU alike.

#pragma once

#include <vector>

#include "likeness/decode/kernel.h"
#include "likeness/decode/network.h"

namespace likeness {

constexpr int PaddedChannels(int channels) {
  return (channels + kChannelMultiple - 1) / kChannelMultiple * kChannelMultiple;
}

// [in_rows][depth][columns], as kernel.h says, for padded channels `in` and `out`; `columns` is at least as many as are
// used, the others are zero.
std::vector<float> GemmWeights(const ConvolutionLayer& layer, int in, int out, int columns);

// The same layer with its outputs in another order: from channel by channel, [channels, area], to texel by texel with
// padded channels, [area, PaddedChannels(channels)]. A bias that is absent stays so.
DenseLayer TexelMajor(const DenseLayer& layer, int area);

}  // namespace likeness
