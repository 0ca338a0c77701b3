// The float32 row kernels, written with the compiler's vector types; included once by a file for each instruction set,
// which defines LIKENESS_VECTOR_BYTES, LIKENESS_TILE (accumulators that fit the registers) and LIKENESS_KERNELS (the
// table's name), and is compiled with that set's flags. Nothing here may call an inline function of another header:
// the linker might choose this file's copy of it for code that runs on lesser processors.

#include "likeness/train/ops/row_kernels.h"

namespace likeness {
namespace {

constexpr int kLanes = LIKENESS_VECTOR_BYTES / 4;
typedef float Vector __attribute__((vector_size(LIKENESS_VECTOR_BYTES), aligned(4), may_alias));

inline float FromBf16(uint16_t value) { return __builtin_bit_cast(float, static_cast<uint32_t>(value) << 16); }

// Rounds to nearest, ties to even; what is not a number stays so.
inline uint16_t ToBf16(float value) {
  const uint32_t bits = __builtin_bit_cast(uint32_t, value);
  const uint32_t rounded = (bits + 0x7fff + ((bits >> 16) & 1)) >> 16;
  return static_cast<uint16_t>((bits & 0x7fffffff) > 0x7f800000 ? 0x7fc0 : rounded);
}

struct FloatSource {
  const float* data;
  float operator[](int i) const { return data[i]; }
};
struct Bf16Source {
  const uint16_t* data;
  float operator[](int i) const { return FromBf16(data[i]); }
};

// Calls body with a typed view of the values.
template <typename Body>
inline void WithSource(RowValues values, const Body& body) {
  if (values.bf16) {
    body(Bf16Source{static_cast<const uint16_t*>(values.data)});
  } else {
    body(FloatSource{static_cast<const float*>(values.data)});
  }
}

#ifndef LIKENESS_BF16_BUFFERS
using Element = float;
inline Element ToElement(float value) { return value; }
#else
using Element = uint16_t;
inline Element ToElement(float value) { return ToBf16(value); }
#endif

// [texels][3], which the end of the buffer holds, -> [texels][8]. Reads and writes whole words: a texel is read before
// its place is overwritten.
void SpreadToEight(int texels, Element* buffer) {
  const Element* from = buffer + 5 * texels;
  for (int t = 0; t < texels; ++t) {
    uint64_t words[2] = {0, 0};
    __builtin_memcpy(&words[0], from + 3 * t, 8);
    words[0] &= 0xffffffffffff;
    __builtin_memcpy(buffer + 8 * t, words, 16);
  }
}

void Load(RowValues from, int texels, int channels, int padded, void* buffer) {
  Element* __restrict to = static_cast<Element*>(buffer);
  WithSource(from, [&](auto source) {
    if (channels == padded) {
      const int count = texels * channels;
      for (int i = 0; i < count; ++i) to[i] = ToElement(source[i]);
      return;
    }
    if (channels == 3 && padded == 8 && sizeof(Element) == 2) {
      for (int i = 0; i < 3 * texels; ++i) to[5 * texels + i] = ToElement(source[i]);
      SpreadToEight(texels, to);
      return;
    }
    for (int t = 0; t < texels; ++t) {
      for (int c = 0; c < channels; ++c) to[t * padded + c] = ToElement(source[t * channels + c]);
    }
  });
}

void LoadGradient(RowValues dy, RowValues y, float slope, int texels, int channels, int padded, void* buffer,
                  float* bias_gradient) {
  Element* __restrict to = static_cast<Element*>(buffer);
  float* __restrict sum = bias_gradient;
  const int count = texels * channels;
  WithSource(dy, [&](auto gradient) {
    WithSource(y, [&](auto value) {
      const auto at = [&](int i) { return (value[i] > 0 ? 1.0f : slope) * gradient[i]; };
      if (sum != nullptr) {
        for (int i = 0; i < count; ++i) sum[i] += at(i);
      }
      if (channels == padded) {
        for (int i = 0; i < count; ++i) to[i] = ToElement(at(i));
        return;
      }
      if (channels == 3 && padded == 8 && sizeof(Element) == 2) {
        for (int i = 0; i < count; ++i) to[5 * texels + i] = ToElement(at(i));
        SpreadToEight(texels, to);
        return;
      }
      for (int t = 0; t < texels; ++t) {
        for (int c = 0; c < channels; ++c) to[t * padded + c] = ToElement(at(t * channels + c));
      }
    });
  });
}

inline float Activated(float a, float slope) {
  const float scaled = slope * a;
  return a > scaled ? a : scaled;
}

void Store(const float* x, const float* bias, int bias_count, float slope, int count, void* y, bool bf16) {
  float* __restrict to = static_cast<float*>(y);
  uint16_t* __restrict to16 = static_cast<uint16_t*>(y);
  for (int begin = 0; begin < count; begin += bias_count) {
    if (bf16) {
      for (int i = 0; i < bias_count; ++i) to16[begin + i] = ToBf16(Activated(x[begin + i] + bias[i], slope));
    } else {
      for (int i = 0; i < bias_count; ++i) to[begin + i] = Activated(x[begin + i] + bias[i], slope);
    }
  }
}

void Copy(const float* x, int count, void* y, bool bf16) {
  float* __restrict to = static_cast<float*>(y);
  uint16_t* __restrict to16 = static_cast<uint16_t*>(y);
  if (bf16) {
    for (int i = 0; i < count; ++i) to16[i] = ToBf16(x[i]);
  } else {
    for (int i = 0; i < count; ++i) to[i] = x[i];
  }
}

template <int kCount>
inline void SplitBy(const float* from, int width, int count, float* first, float* second) {
  for (int i = 0; i < count; ++i, from += width, first += kCount, second += kCount) {
    __builtin_memcpy(first, from, kCount * 4);
    __builtin_memcpy(second, from + kCount, kCount * 4);
  }
}

void Split(const float* from, int width, int pair, int count, float* first, float* second) {
  if (pair == 6) return SplitBy<6>(from, width, count, first, second);
  if (pair == 32) return SplitBy<32>(from, width, count, first, second);
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < pair; ++k) {
      first[i * pair + k] = from[i * width + k];
      second[i * pair + k] = from[i * width + pair + k];
    }
  }
}

#ifndef LIKENESS_BF16_BUFFERS

void PackWeights(const float* weights, int rows, int depth, int width, void* packed) {
  float* to = static_cast<float*>(packed);
  for (int i = 0; i < rows * depth * width; ++i) to[i] = weights[i];
}

// One tile: kTexels x (kVectors x kLanes) results, kept in registers over the whole sum.
template <int kTexels, int kVectors>
inline void MultiplyTile(const void* const* rows, int row_count, int depth, int stride, const float* weights, int width,
                         int texel, float* out) {
  Vector sums[kTexels][kVectors];
#pragma GCC unroll 32
  for (int t = 0; t < kTexels; ++t) {
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) sums[t][v] = Vector{};
  }
  for (int r = 0; r < row_count; ++r) {
    const float* a = static_cast<const float*>(rows[r]) + static_cast<int64_t>(texel) * stride;
    for (int k = 0; k < depth; ++k, weights += width) {
      Vector w[kVectors];
#pragma GCC unroll 4
      for (int v = 0; v < kVectors; ++v) w[v] = *reinterpret_cast<const Vector*>(weights + v * kLanes);
#pragma GCC unroll 32
      for (int t = 0; t < kTexels; ++t) {
#pragma GCC unroll 4
        for (int v = 0; v < kVectors; ++v) sums[t][v] += a[t * stride + k] * w[v];
      }
    }
  }
#pragma GCC unroll 32
  for (int t = 0; t < kTexels; ++t) {
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) *reinterpret_cast<Vector*>(out + t * width + v * kLanes) = sums[t][v];
  }
}

template <int kTexels, int kVectors>
inline void MultiplyColumns(const void* const* rows, int row_count, int depth, int stride, const float* weights,
                            int width, int count, float* out) {
  int texel = 0;
  for (; texel + kTexels <= count; texel += kTexels) {
    MultiplyTile<kTexels, kVectors>(rows, row_count, depth, stride, weights, width, texel, out + texel * width);
  }
  for (; texel < count; texel += 4) {
    MultiplyTile<4, kVectors>(rows, row_count, depth, stride, weights, width, texel, out + texel * width);
  }
}

void Multiply(const void* const* rows, int row_count, int depth, int stride, const void* packed, int width, int count,
              float* out) {
  const float* weights = static_cast<const float*>(packed);
  int column = 0;
  for (; column + 2 * kLanes <= width; column += 2 * kLanes) {
    MultiplyColumns<LIKENESS_TILE / 2, 2>(rows, row_count, depth, stride, weights + column, width, count, out + column);
  }
  if (column < width) {
    MultiplyColumns<LIKENESS_TILE, 1>(rows, row_count, depth, stride, weights + column, width, count, out + column);
  }
}

// One tile of sums: kDepth x (kVectors x kLanes), kept in registers over a whole row.
template <int kDepth, int kVectors>
inline void CorrelateTile(const float* row, int stride, const float* values, int width, int count, float* sums) {
  Vector s[kDepth][kVectors];
#pragma GCC unroll 32
  for (int k = 0; k < kDepth; ++k) {
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) s[k][v] = *reinterpret_cast<Vector*>(sums + k * width + v * kLanes);
  }
  for (int i = 0; i < count; ++i, row += stride, values += width) {
    Vector b[kVectors];
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) b[v] = *reinterpret_cast<const Vector*>(values + v * kLanes);
#pragma GCC unroll 32
    for (int k = 0; k < kDepth; ++k) {
#pragma GCC unroll 4
      for (int v = 0; v < kVectors; ++v) s[k][v] += row[k] * b[v];
    }
  }
#pragma GCC unroll 32
  for (int k = 0; k < kDepth; ++k) {
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) *reinterpret_cast<Vector*>(sums + k * width + v * kLanes) = s[k][v];
  }
}

template <int kVectors>
inline void CorrelateColumns(const float* row, int depth, int stride, const float* values, int width, int count,
                             float* sums) {
  constexpr int kDepth = LIKENESS_TILE / kVectors / 4 * 4;  // depths are multiples of 4
  int k = 0;
  for (; k + kDepth <= depth; k += kDepth) {
    CorrelateTile<kDepth, kVectors>(row + k, stride, values, width, count, sums + k * width);
  }
  for (; k < depth; k += 4) {
    CorrelateTile<4, kVectors>(row + k, stride, values, width, count, sums + k * width);
  }
}

void Correlate(const void* const* rows, int row_count, int depth, int stride, const void* values, int width, int count,
               float* sums, void*) {
  const float* b = static_cast<const float*>(values);
  for (int r = 0; r < row_count; ++r, sums += depth * width) {
    const float* row = static_cast<const float*>(rows[r]);
    int column = 0;
    for (; column + 2 * kLanes <= width; column += 2 * kLanes) {
      CorrelateColumns<2>(row, depth, stride, b + column, width, count, sums + column);
    }
    if (column < width) CorrelateColumns<1>(row, depth, stride, b + column, width, count, sums + column);
  }
}

int64_t ScratchBytes(int, int, int) { return 0; }

#endif

}  // namespace
}  // namespace likeness
