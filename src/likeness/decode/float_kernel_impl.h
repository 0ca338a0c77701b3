// Convolutions with float32 features; included by a kernel after vector_impl.h. LIKENESS_TILE_ROWS is the number of
// result rows whose sums for two vectors of columns fit the registers.

#pragma once

#include "likeness/decode/pixels_impl.h"
#include "likeness/decode/vector_impl.h"

namespace likeness {
namespace {

inline int PanelVectors(int columns) { return columns % (2 * kLanes) == 0 ? 2 : 1; }

int64_t WeightBytes(const PackedConvolution& layer) {
  return static_cast<int64_t>(layer.in_rows) * layer.depth * layer.columns * 4;
}

// [panel][row][k][column]
bool PackWeights(const float* weights, const PackedConvolution& layer, void* packed) {
  const int panel = PanelVectors(layer.columns) * kLanes;
  const int64_t values = static_cast<int64_t>(layer.in_rows) * layer.depth;
  float* to = static_cast<float*>(packed);
  for (int n = 0; n < layer.columns; n += panel) {
    for (int64_t k = 0; k < values; ++k) {
      for (int i = 0; i < panel; ++i) *to++ = weights[k * layer.columns + n + i];
    }
  }
  return true;
}

// One tile: kRows x (kVectors x kLanes) sums, kept in registers.
template <int kRows, int kVectors>
inline void MultiplyTile(const void* const* in, const PackedConvolution& layer, const float* weights, int row,
                         float* out, int width) {
  const int stride = layer.channels;
  Vector sums[kRows][kVectors];
#pragma GCC unroll 32
  for (int t = 0; t < kRows; ++t) {
#pragma GCC unroll 2
    for (int v = 0; v < kVectors; ++v) sums[t][v] = Vector{};
  }
  for (int r = 0; r < layer.in_rows; ++r) {
    const float* a = static_cast<const float*>(in[r]) + static_cast<int64_t>(row) * stride;
    for (int k = 0; k < layer.depth; ++k, weights += kVectors * kLanes) {
      Vector w[kVectors];
#pragma GCC unroll 2
      for (int v = 0; v < kVectors; ++v) w[v] = Load(weights + v * kLanes);
#pragma GCC unroll 32
      for (int t = 0; t < kRows; ++t) {
#pragma GCC unroll 2
        for (int v = 0; v < kVectors; ++v) sums[t][v] += a[t * stride + k] * w[v];
      }
    }
  }
#pragma GCC unroll 32
  for (int t = 0; t < kRows; ++t) {
#pragma GCC unroll 2
    for (int v = 0; v < kVectors; ++v) Store(out + static_cast<int64_t>(t) * width + v * kLanes, sums[t][v]);
  }
}

template <int kVectors>
inline void MultiplyPanel(const void* const* in, const PackedConvolution& layer, const float* weights, int row,
                          int count, float* out, int width) {
  constexpr int kTile = LIKENESS_TILE_ROWS * 2 / kVectors;
  const int end = row + count;
  for (; row + kTile <= end; row += kTile, out += static_cast<int64_t>(kTile) * width) {
    MultiplyTile<kTile, kVectors>(in, layer, weights, row, out, width);
  }
  for (; row < end; row += 4, out += static_cast<int64_t>(4) * width) {
    MultiplyTile<4, kVectors>(in, layer, weights, row, out, width);
  }
}

void Multiply(const void* const* in, const PackedConvolution& layer, int first, int columns, int row, int count,
              float* out) {
  const int vectors = PanelVectors(layer.columns), panel = vectors * kLanes;
  const int64_t values = static_cast<int64_t>(layer.in_rows) * layer.depth;
  for (int n = 0; n < columns; n += panel) {
    const float* weights = static_cast<const float*>(layer.weights) + (first + n) * values;
    if (vectors == 2) {
      MultiplyPanel<2>(in, layer, weights, row, count, out + n, columns);
    } else {
      MultiplyPanel<1>(in, layer, weights, row, count, out + n, columns);
    }
  }
}

void Block(const BlockJob& job, float* sums) {
  Multiply(job.in, *job.layer, job.first_column, job.columns, 0, job.count, sums);
}

void Finish(const PackedConvolution& layer, const float* sums, const void* bias, const float* add, int count,
            void* features) {
  const float slope = layer.slope;
  float* const to = static_cast<float*>(features);
  const Half* const b = static_cast<const Half*>(bias);
  for (int i = 0; i < count; i += kLanes) {
    const Vector v = Load(sums + i) + LoadHalf(b + i);
    Vector y = Max(v, slope * v);
    if (add != nullptr) y += Load(add + i);
    Store(to + i, y);
  }
}

// The activation of a chunk: part r of each result row goes to one place after the other.
inline void FinishChunk(const RowJob& job, const float* sums, int row, int count) {
  const PackedConvolution& layer = *job.layer;
  const int part = layer.columns / layer.out_rows;
  const float slope = layer.slope;
  for (int r = 0; r < layer.out_rows; ++r) {
    const Half* bias = static_cast<const Half*>(job.bias[r]) + static_cast<int64_t>(row) * part;
    float* to = static_cast<float*>(job.out[r]) + static_cast<int64_t>(row) * part;
    const float* from = sums + r * part;
    for (int i = 0; i < count; ++i, from += layer.columns, bias += part, to += part) {
      for (int n = 0; n < part; n += kLanes) {
        const Vector v = Load(from + n) + LoadHalf(bias + n);
        Vector y = Max(v, slope * v);
        if (job.add != nullptr) y += Load(job.add + n % job.add_count);
        Store(to + n, y);
      }
    }
  }
}

void Rows(const RowJob& job, void* scratch) {
  const PackedConvolution& layer = *job.layer;
  float* const sums = static_cast<float*>(scratch);
  for (int row = 0; row < layer.count; row += kChunk) {
    const int count = layer.count - row < kChunk ? layer.count - row : kChunk;
    Multiply(job.in, layer, 0, layer.columns, row, count, sums);
    FinishChunk(job, sums, row, count);
  }
}

void StoreFeatures(const float* values, int count, float, void* features) {
  for (int i = 0; i < count; i += kLanes) Store(static_cast<float*>(features) + i, Load(values + i));
}

}  // namespace
}  // namespace likeness
