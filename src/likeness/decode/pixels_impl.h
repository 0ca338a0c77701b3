// Colours of a row by way of sums in float32, for kernels that define what is declared here.

#pragma once

#include "likeness/decode/vector_impl.h"

namespace likeness {
namespace {

constexpr int kChunk = 24;  // result rows whose sums stay in the first-level cache

// Sums of columns [first, first + columns) of result rows [row, row + count), to out [count][columns].
void Multiply(const void* const* in, const PackedConvolution& layer, int first, int columns, int row, int count,
              float* out);
// NOLINTBEGIN(readability-redundant-declaration): some kernels define them before they include this.
bool PackColours(const float* values, int count, void* packed);
void Convert(const float* values, int count, PixelFormat format, void* pixels);
inline void AddEight(const float* sums, const Half* bias, float* to);  // to = sums + bias
// NOLINTEND(readability-redundant-declaration)

// Colours: [row part][result row][part], part = 4 or 8 values: texels in their order.
int64_t PixelBiasBytes(const PackedConvolution& layer) {
  return static_cast<int64_t>(layer.count + kRowSlack) * 16 * static_cast<int64_t>(sizeof(Half));
}

inline int PixelPart(const PackedConvolution& layer) { return layer.out_rows == 2 ? 8 : 4; }

bool PackPixelBias(const float* const* rows, const PackedConvolution& layer, void* packed) {
  const int part = PixelPart(layer);
  bool fits = true;
  for (int r = 0; r < layer.out_rows; ++r) {
    Half* const to = static_cast<Half*>(packed) + static_cast<int64_t>(r) * (layer.count + kRowSlack) * part;
    fits = PackColours(rows[r], layer.count * part, to) && fits;
  }
  return fits;
}

void Pixels(const PixelJob& job, void* scratch) {
  const PackedConvolution& layer = *job.layer;
  const int part = PixelPart(layer), pitch = (layer.count + kRowSlack) * part;
  float* const sums = static_cast<float*>(scratch);
  float* const lines = sums + (kChunk + kRowSlack) * layer.columns;
  const Half* const bias = static_cast<const Half*>(job.bias);
  for (int row = 0; row < layer.count; row += kChunk) {
    const int count = layer.count - row < kChunk ? layer.count - row : kChunk;
    Multiply(job.in, layer, 0, layer.columns, row, count, sums);
    for (int r = 0; r < layer.out_rows; ++r) {
      float* const line = lines + r * pitch + row * part;
      const Half* const b = bias + r * pitch + row * part;
      for (int i = 0; i < count; ++i) {
        const float* const from = sums + i * layer.columns + r * part;
        if (part == 8) {
          AddEight(from, b + i * 8, line + i * 8);
        } else {
          for (int c = 0; c < part; ++c) line[i * part + c] = from[c] + FromHalf(b[i * part + c]);
        }
      }
    }
  }
  for (int r = 0; r < layer.out_rows; ++r) {
    if (job.pixels[r] != nullptr) Convert(lines + r * pitch - 4 * job.first_texel, job.size, job.format, job.pixels[r]);
  }
}

}  // namespace
}  // namespace likeness
