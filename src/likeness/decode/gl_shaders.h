// The compute shaders of the decoder on a GPU, generated from the shapes of a network's layers.
//
// Features are [y][x][view][channel]: the texels of two views lie side by side and are rows of one product, so that
// weights and biases are read once for both. Everything is stored and read by fours of values, in half precision or
// float32; sums are in float32. Buffers, by binding:
//
//   0  input    features, or for dense layers the values that both views share, [shared_in], float32
//   1  weights  [depth][columns], as layout.h says; of dense layers the transposed weights
//   2  biases   of dense layers in float32
//   3  frame    what the processor writes for a frame, float32
//   4  results  features or, with `plain`, float32
//
// Textures are the image units 0 and 1, a view each. The uniform at location 0 is the number of views; convolutions
// have another at location 1, which is 4.

#pragma once

#include <string>

#include "likeness/decode/kernel.h"

namespace likeness {

// Work groups are counted along y up to this many, then along z: drivers need not allow more than 65535 along one.
inline constexpr int kMostGlGroups = 256;

struct GlStorage {
  bool half = true;
  PixelFormat format = PixelFormat::kRgba8;  // of textures
};

// What becomes of a layer's sums.
struct GlResults {
  enum class Kind {
    kFeatures,  // act(sums), and what is added to the next layer's input
    kPlain,     // the same in float32
    kColours,   // sums / 255, into the textures
  };
  Kind kind = Kind::kFeatures;
  int size = 1;      // texels a side
  int channels = 4;  // padded to a multiple of 4
  float slope = 1;
  int add_at = -1;  // in the frame, in fours: [view][channels]; -1: nothing is added
};

// y = act(W x + b), for outputs that are texels one after the other. Each invocation makes four outputs of a share of
// the inputs; shares are summed up in shared memory.
struct GlDenseShape {
  int shared_in = 0;   // inputs that both views share, a multiple of 4; they come first in the weights
  int view_in = 0;     // those of each view, from the frame, a multiple of 4
  int view_in_at = 0;  // in the frame, in fours
  GlResults results;

  static constexpr int kColumnsAtOnce = 32;  // fours of outputs of a work group
  static constexpr int kShares = 8;

  int fours() const { return results.size * results.size * results.channels / 4; }
};

// A convolution, as rows and columns of a dense product (kernel.h): row i of `grid` x `grid` x views.
struct GlConvolutionShape {
  bool up = true;  // kUp, or else kSame
  int in_size = 0;
  int in_channels = 0;      // a multiple of kChannelMultiple
  bool every_texel = true;  // biases are for every texel
  int tile_rows = 64;       // of the result, of a work group; each invocation makes 4 x 4 values
  int tile_columns = 64;
  GlResults results;

  int window() const { return up ? 2 : 3; }
  int step() const { return up ? 2 : 1; }
  int grid() const { return up ? in_size + 1 : in_size; }
  int depth() const { return window() * window() * in_channels; }
  int columns() const { return step() * step() * results.channels; }
};

std::string DenseShader(const GlDenseShape& shape, const GlStorage& storage);
std::string ConvolutionShader(const GlConvolutionShape& shape, const GlStorage& storage);

}  // namespace likeness
