// The inner loops of the decoder, in variants for the processor's instruction sets: a file each, compiled with its own
// flags. Plain data and function pointers only: no file here may call an inline function of another header, since the
// linker might choose its copy of that function for code that runs on lesser processors.
//
// Features have their channels interleaved, padded with zeros to a multiple of kChannelMultiple. Both kinds of
// convolution are dense products over rows of texels: result row i of a job is
//
//   kUp    sum over dy in {0, 1}, k        of in[dy][C i + k] W[dy][k][n],  k = dx C + c,  n = (r, x, o)
//   kSame  sum over dy in {0, 1, 2}, k     of in[dy][C i + k] W[dy][k][n],  n = o
//
// where in[dy] points to texel -1 of the rows m, m + 1 (kUp) or y - 1, y, y + 1 (kSame). kUp's row i is the block of
// texels {2 m + 1, 2 m + 2} x {2 i - 1, 2 i} of the output, all of which read the same 2 x 2 of the input, so that no
// product is with a zero: taps[2 + r - 2 dy][2 + x - 2 dx].

#pragma once

#include <stdint.h>

namespace likeness {

constexpr int kChannelMultiple = 16;  // of features; colours have 4 channels: red, green, blue, opacity
constexpr int kColumnBlock = 32;      // early layers are split over threads by blocks of columns
constexpr int kRowSlack = 64;         // result rows that a kernel may read and write past the end of a row
constexpr int kDenseBlock = 16;       // outputs of a dense layer that are computed together

enum class PixelFormat { kRgba8, kRgba16F };

// A packed convolution.
struct PackedConvolution {
  int in_rows = 0;   // 2 for kUp, 3 for kSame
  int out_rows = 0;  // 2, 1
  int channels = 0;  // of the input, padded: result rows are this many values of the input apart
  int depth = 0;     // values that a result row reads of each input row: 2 or 3 times channels
  int columns = 0;   // n, a multiple of 16; out_rows equal parts, each contiguous in an output row
  int count = 0;     // result rows a row of the image
  float slope = 1;
  bool colours = false;  // the last layer
  // Features that fixed_point kernels can represent, of the input and of the output, are within +- these.
  float in_range = 1, out_range = 1;
  const void* weights = nullptr;
};

struct RowJob {
  const PackedConvolution* layer = nullptr;
  const void* in[3] = {};
  void* out[2] = {};           // where each part of result row 0 goes
  const void* bias[2] = {};    // laid out as `out`
  const float* add = nullptr;  // added after the activation, a value a channel; null without
  int add_count = 0;           // output channels
};

// The last layer: colours.
struct PixelJob {
  const PackedConvolution* layer = nullptr;
  const void* in[3] = {};
  const void* bias = nullptr;  // as pack_pixel_bias made it
  void* pixels[2] = {};        // first texel of each row, RGBA; null for a row outside of the image
  int first_texel = 0;         // of the job's results: -1 for kUp, 0 for kSame
  int size = 0;                // texels in a row
  PixelFormat format = PixelFormat::kRgba8;
};

// Sums of a range of columns for many result rows, to be finished by `finish`.
struct BlockJob {
  const PackedConvolution* layer = nullptr;
  const void* in[3] = {};
  int first_column = 0;
  int columns = 0;
  int count = 0;  // result rows
};

// A dense layer: y[o] = act(init[o] + sum over i of weight[o][i] x[i]), for blocks [first, last) of kDenseBlock outputs
// and `vectors` inputs at once.
struct DenseJob {
  const void* weights = nullptr;  // [block][in][kDenseBlock]
  const float* init = nullptr;    // null: zero
  const float* x = nullptr;       // [vectors][x_pitch]
  float* y = nullptr;             // [vectors][y_pitch], of the blocks from `first` on
  int64_t x_pitch = 0, y_pitch = 0;
  int in = 0;
  int first = 0, last = 0;
  int vectors = 1;
  float slope = 1;
};

struct Kernel {
  const char* name;
  bool full_precision;  // float32 features and weights; otherwise its accuracy is checked for every avatar
  bool fixed_point;     // features are integers: their ranges are measured on the avatar's own codes
  int element_bytes;    // of features
  int bias_bytes;
  int dense_bytes;  // of dense layers' weights

  bool (*available)();

  // Called by each thread before and after it works; `leave` gets what `enter` returned.
  unsigned (*enter)();
  void (*leave)(unsigned mode);

  // weights [in_rows][depth][columns] -> packed; as many bytes as weight_bytes says. These `pack` functions return
  // false where a value cannot be represented.
  int64_t (*weight_bytes)(const PackedConvolution& layer);
  bool (*pack_weights)(const float* weights, const PackedConvolution& layer, void* packed);
  bool (*pack_bias)(const PackedConvolution& layer, const float* values, int count, void* packed);
  // rows[r] are values of the two (one) output rows, 4 channels, from the job's first result row on, `count` result
  // rows of them and kRowSlack more.
  int64_t (*pixel_bias_bytes)(const PackedConvolution& layer);
  bool (*pack_pixel_bias)(const float* const* rows, const PackedConvolution& layer, void* packed);
  bool (*pack_dense)(const float* values, int64_t count, void* packed);

  void (*store)(const float* values, int count, float range, void* features);

  void (*rows)(const RowJob& job, void* scratch);
  void (*pixels)(const PixelJob& job, void* scratch);
  void (*block)(const BlockJob& job, float* sums);  // sums [count + kRowSlack][columns]
  // features = act(sums + bias) + add, of `count` columns of one result row
  void (*finish)(const PackedConvolution& layer, const float* sums, const void* bias, const float* add, int count,
                 void* features);
  void (*dense)(const DenseJob& job);
  // values [count][4] from 0 to 255 -> pixels
  void (*convert)(const float* values, int count, PixelFormat format, void* pixels);
};

constexpr int64_t kScratchBytes = 1 << 18;  // of a thread, for `rows` and `pixels`, with rows of up to 4096 texels

}  // namespace likeness
