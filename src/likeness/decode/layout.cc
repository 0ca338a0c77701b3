#include "likeness/decode/layout.h"

#include <algorithm>

namespace likeness {

std::vector<float> GemmWeights(const ConvolutionLayer& layer, int in, int out, int columns) {
  const bool up = layer.kind == ConvolutionLayer::Kind::kUp;
  const int side = layer.taps_a_side(), windows = up ? 2 : 3;
  std::vector<float> weights(static_cast<size_t>(windows) * windows * in * columns, 0.0f);
  for (int dy = 0; dy < windows; ++dy) {
    for (int dx = 0; dx < windows; ++dx) {
      for (int r = 0; r < (up ? 2 : 1); ++r) {
        for (int x = 0; x < (up ? 2 : 1); ++x) {
          const int ky = up ? 2 + r - 2 * dy : dy, kx = up ? 2 + x - 2 * dx : dx;
          const float* from = layer.taps.data() + static_cast<size_t>(ky * side + kx) * layer.in * layer.out;
          for (int i = 0; i < layer.in; ++i, from += layer.out) {
            const size_t row = static_cast<size_t>(dy * windows + dx) * in + i;
            std::copy(from, from + layer.out, weights.data() + row * columns + (r * 2 + x) * out);
          }
        }
      }
    }
  }
  return weights;
}

DenseLayer TexelMajor(const DenseLayer& layer, int area) {
  const int channels = layer.out / area, padded = PaddedChannels(channels);
  DenseLayer texels{layer.in, area * padded, {}, {}, layer.slope};
  texels.weight.assign(static_cast<size_t>(texels.out) * layer.in, 0.0f);
  texels.bias.assign(layer.bias.empty() ? 0 : texels.out, 0.0f);
  for (int c = 0; c < channels; ++c) {
    for (int at = 0; at < area; ++at) {
      const int from = c * area + at, to = at * padded + c;
      std::copy_n(layer.weight.begin() + static_cast<ptrdiff_t>(from) * layer.in, layer.in,
                  texels.weight.begin() + static_cast<ptrdiff_t>(to) * layer.in);
      if (!layer.bias.empty()) texels.bias[to] = layer.bias[from];
    }
  }
  return texels;
}

}  // namespace likeness
