// What the run time computes, as a plain description that drives every kernel: an avatar file's decoder, checked and
// folded. All that a convolution can be (transposed, upsampled, residual) becomes one of two kinds; the last layer
// gives colours, with the mean texture and the standard deviation in its weights and biases.

#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "likeness/avatar/architecture.h"
#include "likeness/avatar/safetensors.h"

namespace likeness {

// Shown colour = gain x colour + offset, for red, green and blue from 0 to 255, before it is clamped and rounded.
struct DisplayTransform {
  std::array<float, 3> gain = {1, 1, 1};
  std::array<float, 3> offset = {0, 0, 0};
};

// y = act(W x + b); act(v) = max(v, slope v).
struct DenseLayer {
  int in = 0;
  int out = 0;
  std::vector<float> weight;  // [out, in]
  std::vector<float> bias;    // [out]
  float slope = 1;
  // [out, NamedChannels]: of the standardised named conditions, whose part is in the bias already. For those who would
  // change them from frame to frame; empty in layers that do not meet them.
  std::vector<float> named = {};

  bool empty() const { return out == 0; }
};

// y = act(taps * x + b).
struct ConvolutionLayer {
  enum class Kind {
    kUp,    // transposed, 4 x 4, stride 2, padding 1: out[2 i - 1 + k] += taps[k] in[i]
    kSame,  // 3 x 3, padding 1: out[i] = sum of taps[k] in[i + k - 1]
  };
  Kind kind = Kind::kUp;
  int in = 0;  // channels
  int out = 0;
  int in_size = 0;  // texels a side
  int out_size = 0;
  std::vector<float> taps;      // [ky, kx, in, out]
  std::span<const float> bias;  // [out] or [out, out_size, out_size], in the file
  float slope = kLeakySlope;
  // Added to this layer's input at every texel: an affine map of the view features. Empty without.
  DenseLayer view_add;

  int taps_a_side() const { return kind == Kind::kUp ? kKernel : kSameKernel; }
};

// Of one person, under the named conditions' means: what these add is folded into the layers that meet the code.
struct DecoderNetwork {
  explicit DecoderNetwork(SafetensorsFile opened) : file(std::move(opened)) {}

  Architecture architecture;
  DenseLayer code;        // the code to 256 features; empty in linear models, whose features are the code itself
  DenseLayer mesh;        // features to x y z after x y z, millimetres
  DenseLayer view;        // 3 values to view features; empty where these are the view itself
  DenseLayer inner;       // features to the first texture features, channel by channel and row by row
  DenseLayer inner_view;  // of the view features, added to `inner` before its activation; no bias; may be empty
  std::vector<ConvolutionLayer> layers;  // empty in linear models
  DenseLayer texels;  // linear models: features (bilinear: times view x, y, z) to colours, rgb after rgb, row by row

  std::array<float, 3> gain = {1, 1, 1};    // from the network's units to shown colours
  std::array<float, 3> offset = {0, 0, 0};  // after the mean texture is added
  std::array<float, 3> mean_gain = {1, 1, 1};
  std::span<const float> texture_mean;  // [S, S, 3]

  std::vector<float> mean_code;                // [latent]: of the file's codes; zeros where it has none
  std::vector<std::vector<float>> some_codes;  // a few of the file's codes, evenly spread
  std::vector<int32_t> triangles;              // [T, 3] indices of vertices
  std::vector<int32_t> triangle_uvs;           // [T, 3] indices into uvs
  std::vector<float> uvs;                      // [U, 2]

  // Spans point here: the file's bytes, and copies of tensors that do not lie at a multiple of 4 bytes.
  SafetensorsFile file;
  std::map<std::string, std::vector<float>> copies;

  // Biases of one row of a layer's output, [out_size, out]; of the last layer with the mean texture, and scaled.
  void BiasRow(const ConvolutionLayer& layer, int y, float* row) const;
  bool HasBiasForEveryTexel(const ConvolutionLayer& layer) const {
    return &layer == &layers.back() || layer.bias.size() != static_cast<size_t>(layer.out);
  }
};

//   person      whose face, of an avatar of several people
//   conditions  all values of the named ones, as captured; empty: their means
// Throws Error naming the file when it is no avatar, is damaged, or has what the run time does not know.
DecoderNetwork NetworkFrom(SafetensorsFile file, const DisplayTransform& display, int person,
                           std::span<const float> conditions = {});

}  // namespace likeness
