// The inner loops of the k4 s2 p1 convolutions, one row of texels at a time, in variants for the processor's
// instruction sets. No LibTorch here: what calls them is ops/texture_layer.cc.
//
// A convolution takes a large image [2H, 2W, L] to a small one [H, W, S], channels interleaved; a transposed one goes
// the other way. Both are dense products over rows of a buffer that has one texel of padding at either end:
//
//   small[x, s]            = sum over ky, k of  large_row(2y + ky - 1)[2 L x + k]  W[ky][k][s],      k = kx L + l
//   large[2x + 1 + c, l]   = sum over dy, k of  small_row(y + dy)[S (x + 1) + k]   W'[dy][k][r c l], k = dx S + s
//
// The second writes the block of large texels {2y+1, 2y+2} x {2x+1, 2x+2}, all of which read the same 2 x 2 small
// ones, so that no product is with a zero. W' holds the values of W with ky = 2 + r - 2 dy, kx = 2 + c - 2 dx.

#pragma once

#include <cstdint>
#include <vector>

namespace likeness {

// Values in memory outside of the kernels' own buffers: float32 or bfloat16.
struct RowValues {
  const void* data = nullptr;
  bool bf16 = false;
};

struct RowKernels {
  const char* name;
  int element_bytes;     // of the kernels' buffers: 4 float32, 2 bfloat16
  int channel_multiple;  // channels in the buffers are padded with zeros to a multiple of this
  int width_multiple;    // so are the columns of weights and results
  bool columns_first;    // how Correlate lays out its sums
  int count_slack;       // texels that may be read and written beyond `count`

  // Packs weights [rows * depth, width], padded, as Multiply wants them: as many elements.
  void (*pack_weights)(const float* weights, int rows, int depth, int width, void* packed);

  // out[i][n] = sum over r, k of rows[r][i stride + k] weights[r][k][n], for i < count, k < depth, n < width.
  void (*multiply)(const void* const* rows, int row_count, int depth, int stride, const void* packed, int width,
                   int count, float* out);

  // sums[r][k][n] += sum over i of rows[r][i stride + k] values[i width + n]; sums[r][n][k] with columns_first.
  // scratch  scratch_bytes(depth, width, count) bytes
  void (*correlate)(const void* const* rows, int row_count, int depth, int stride, const void* values, int width,
                    int count, float* sums, void* scratch);
  int64_t (*scratch_bytes)(int depth, int width, int count);

  // Copies texels to a buffer; [texels][channels] -> [texels][padded].
  void (*load)(RowValues from, int texels, int channels, int padded, void* buffer);
  // The same for the gradient of y = leaky_relu(. + bias): dy times the activation's slope at y.
  //   bias_gradient  null, or [texels][channels]: the row is added to it
  void (*load_gradient)(RowValues dy, RowValues y, float slope, int texels, int channels, int padded, void* buffer,
                        float* bias_gradient);

  // first[i][k] = from[i][k], second[i][k] = from[i][pair + k], k < pair, of rows of `width` values.
  void (*split)(const float* from, int width, int pair, int count, float* first, float* second);
  // y = leaky_relu(x + bias) for `count` contiguous values.
  //   bias    [bias_count], repeated over the row: channels for a tied bias, count for an untied one
  void (*store)(const float* x, const float* bias, int bias_count, float slope, int count, void* y, bool bf16);
  // y = x
  void (*copy)(const float* x, int count, void* y, bool bf16);
};

// The best variant for this processor: in float32, or with bfloat16 operands, which is null where the processor has no
// matrix unit for them.
const RowKernels& FloatRowKernels();
const RowKernels* Bfloat16RowKernels();

// All that this processor can run, for tests; `missing` gets the names of the others.
std::vector<const RowKernels*> AvailableRowKernels(std::vector<const char*>* missing = nullptr);

}  // namespace likeness
