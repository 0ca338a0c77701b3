// Convolutions with 16-bit fixed-point features and weights and 32-bit sums; included by a kernel, with the macros of
// int16_vectors_impl.h. Layers whose columns are a multiple of Wide::kColumns are worked on by Wide, others by Narrow:
// two vectors of sums for kColumns columns, which `Join` makes into one vector of as many 16-bit values.
//
// A feature f of a layer whose range is R is stored as f kMost / R. With integer weights w = W scale, a sum of products
// shifted right is the next layer's feature in its own steps; scale and shift are a layer's. The scale is as large as
// sums of any features in range allow, so that no sum can overflow: 8192 |w|_1 < 2^31 for every column. Before the
// activation values may be four times as large as the range; then they are clamped to it.

#pragma once

#include "likeness/decode/int16_vectors_impl.h"
#include "likeness/decode/vector_impl.h"

namespace likeness {
namespace {

constexpr int kMost = 8191;        // of stored features
constexpr float kLimit = 262144;   // 2^31 / 8192, of a column's sum of |w|
constexpr int kGroup = 16;         // columns that a colour's result row has, and granularity of every layer
constexpr int kChunk = 48;         // result rows whose input and output stay in the first-level cache
constexpr float kPixelSteps = 64;  // colours are in fixed point of this many steps
constexpr int kPixelShift = 6;     // its logarithm

// At the start of packed weights.
struct alignas(64) Head {
  int32_t shift = 0;
};

inline int16_t Rounded16(float value) {
  const float limited = value < -32767 ? -32767 : value > 32767 ? 32767 : value;
  return static_cast<int16_t>(__builtin_rintf(limited));
}
inline bool Fits16(float value) { return value > -32767.5f && value < 32767.5f; }

// Steps of the layer's output in one unit.
inline float OutSteps(const PackedConvolution& layer) {
  return layer.colours ? kPixelSteps : static_cast<float>(kMost) / layer.out_range;
}

int64_t WeightBytes(const PackedConvolution& layer) {
  return static_cast<int64_t>(sizeof(Head)) + static_cast<int64_t>(layer.in_rows) * layer.depth * layer.columns * 2;
}

// The column that lane `lane` of vector `v` of a group has, so that joined values are in their order.
inline int ColumnOf(int v, int lane) { return lane / 4 * 8 + v * 4 + lane % 4; }

inline int PanelColumns(const PackedConvolution& layer) {
  return layer.columns % Wide::kColumns == 0 ? Wide::kColumns : Narrow::kColumns;
}

// [panel][k / 2][vector][lane][2]
bool PackWeights(const float* weights, const PackedConvolution& layer, void* packed) {
  const int64_t depth = static_cast<int64_t>(layer.in_rows) * layer.depth;
  float largest = 0, sum = 0;
  for (int n = 0; n < layer.columns; ++n) {
    float of_column = 0;
    for (int64_t k = 0; k < depth; ++k) {
      const float w = __builtin_fabsf(weights[k * layer.columns + n]);
      of_column += w;
      largest = w > largest ? w : largest;
    }
    sum = of_column > sum ? of_column : sum;
  }
  const float steps = OutSteps(layer) * layer.in_range / static_cast<float>(kMost);
  // Rounding adds at most a half to each weight, and to a sum half of a step: with the largest shift 2^19 = 64 x 8192.
  const float limit = kLimit - 0.5f * static_cast<float>(depth) - 65;
  int shift = 20;
  while (shift > 0 && !(largest * steps * static_cast<float>(1 << shift) < 32767 &&
                        sum * steps * static_cast<float>(1 << shift) < limit)) {
    --shift;
  }
  if (shift == 0) return false;
  const float scale = steps * static_cast<float>(1 << shift);
  Head head;
  head.shift = shift;
  __builtin_memcpy(packed, &head, sizeof(head));
  int16_t* to = reinterpret_cast<int16_t*>(static_cast<char*>(packed) + sizeof(head));
  const int panel = PanelColumns(layer);
  for (int n = 0; n < layer.columns; n += panel) {
    for (int64_t k = 0; k < depth; k += 2) {
      for (int i = 0; i < panel; ++i) {
        const int column = n + ColumnOf(i / (panel / 2), i % (panel / 2));
        *to++ = Rounded16(weights[k * layer.columns + column] * scale);
        *to++ = Rounded16(weights[(k + 1) * layer.columns + column] * scale);
      }
    }
  }
  return true;
}

bool PackBias(const PackedConvolution& layer, const float* values, int count, void* packed) {
  int16_t* const to = static_cast<int16_t*>(packed);
  const float steps = OutSteps(layer);
  bool fits = true;
  for (int i = 0; i < count; ++i) {
    fits = fits && Fits16(values[i] * steps);
    to[i] = Rounded16(values[i] * steps);
  }
  return fits;
}

// What every tile of a call needs to know.
struct Product {
  const void* const* in;
  int in_rows, depth, stride, shift;
};

inline Product ProductOf(const void* const* in, const PackedConvolution& layer) {
  Head head;
  __builtin_memcpy(&head, layer.weights, sizeof(head));
  return {in, layer.in_rows, layer.depth, layer.channels, head.shift};
}

inline const int16_t* PanelWeights(const PackedConvolution& layer, int column) {
  return reinterpret_cast<const int16_t*>(static_cast<const char*>(layer.weights) + sizeof(Head)) +
         static_cast<int64_t>(layer.in_rows) * layer.depth * column;
}

// One tile: kRows result rows x a panel of columns. finish(t, values) gets the t-th row's sums in steps of the output.
template <class V, int kRows, class Finish>
__attribute__((always_inline)) inline void MultiplyTile(const Product& product, const int16_t* weights, int row,
                                                        const Finish& finish) {
  typename V::Type sums[kRows][2];
  const typename V::Type half = V::Set32(1 << (product.shift - 1));
#pragma GCC unroll 16
  for (int t = 0; t < kRows; ++t) sums[t][0] = sums[t][1] = half;
  const int stride = product.stride;
  for (int r = 0; r < product.in_rows; ++r) {
    const int16_t* a = static_cast<const int16_t*>(product.in[r]) + static_cast<int64_t>(row) * stride;
    const int16_t* const end = a + product.depth;
    for (; a < end; a += 2, weights += 2 * V::kColumns) {
      const typename V::Type low = V::Load(weights), high = V::Load(weights + V::kColumns);
#pragma GCC unroll 16
      for (int t = 0; t < kRows; ++t) {
        const typename V::Type pair = V::Pair(a + t * stride);
        sums[t][0] = V::Dot(sums[t][0], pair, low);
        sums[t][1] = V::Dot(sums[t][1], pair, high);
      }
    }
  }
#pragma GCC unroll 16
  for (int t = 0; t < kRows; ++t) finish(t, V::Join(sums[t][0], sums[t][1], product.shift));
}

// Result rows [row, end) of one panel; finish(row, values).
template <class V, class Finish>
__attribute__((always_inline)) inline void MultiplyPanel(const Product& product, const int16_t* weights, int row,
                                                         int end, const Finish& finish) {
  const auto finish_row = [&](int t, typename V::Type values) { finish(row + t, values); };
  for (; row + V::kRows <= end; row += V::kRows) MultiplyTile<V, V::kRows>(product, weights, row, finish_row);
  for (; row < end; row += 2) MultiplyTile<V, 2>(product, weights, row, finish_row);
}

template <class V>
struct Activation {
  typename V::Type slope;
  typename V::Type most = V::Set16(kMost), least = V::Set16(-kMost);

  explicit Activation(float of_layer) : slope(V::Set16(Rounded16(of_layer * 32768))) {}
  typename V::Type operator()(typename V::Type sums, typename V::Type bias, typename V::Type add) const {
    const typename V::Type v = V::Add(sums, bias);
    return V::Max(V::Min(V::Add(V::Max(v, V::Scale(v, slope)), add), most), least);
  }
};

template <class V>
void RowsOf(const RowJob& job, int16_t* adds) {
  const PackedConvolution& layer = *job.layer;
  const int part = layer.columns / layer.out_rows;
  for (int n = 0; n < part; ++n) {
    adds[n] = job.add != nullptr ? Rounded16(job.add[n % job.add_count] * OutSteps(layer)) : int16_t{0};
  }
  const Product product = ProductOf(job.in, layer);
  const Activation<V> activate(layer.slope);
  for (int row = 0; row < layer.count; row += kChunk) {
    const int end = layer.count - row < kChunk ? layer.count : row + kChunk;
    for (int n = 0; n < layer.columns; n += V::kColumns) {
      const int r = n / part, column = n % part;
      const int16_t* const bias = static_cast<const int16_t*>(job.bias[r]) + column;
      int16_t* const out = static_cast<int16_t*>(job.out[r]) + column;
      const typename V::Type add = V::Load(adds + column);
      MultiplyPanel<V>(product, PanelWeights(layer, n), row, end, [&](int i, typename V::Type sums) {
        const int64_t at = static_cast<int64_t>(i) * part;
        V::Store(out + at, activate(sums, V::Load(bias + at), add));
      });
    }
  }
}

void Rows(const RowJob& job, void* scratch) {
  int16_t* const adds = static_cast<int16_t*>(scratch);
  if (job.layer->columns % Wide::kColumns == 0) return RowsOf<Wide>(job, adds);
  RowsOf<Narrow>(job, adds);
}

// Sums of a block of columns are 16-bit values; a result row still has the place of as many 32-bit ones.
template <class V>
void BlockOf(const BlockJob& job, int16_t* out) {
  const PackedConvolution& layer = *job.layer;
  const Product product = ProductOf(job.in, layer);
  for (int n = 0; n < job.columns; n += V::kColumns) {
    MultiplyPanel<V>(
        product, PanelWeights(layer, job.first_column + n), 0, job.count,
        [&](int i, typename V::Type sums) { V::Store(out + static_cast<int64_t>(i) * 2 * job.columns + n, sums); });
  }
}

void Block(const BlockJob& job, float* sums) {
  int16_t* const out = reinterpret_cast<int16_t*>(sums);
  if (job.layer->columns % Wide::kColumns == 0) return BlockOf<Wide>(job, out);
  BlockOf<Narrow>(job, out);
}

void Finish(const PackedConvolution& layer, const float* sums, const void* bias, const float* add, int count,
            void* features) {
  const int16_t* const from = reinterpret_cast<const int16_t*>(sums);
  const int16_t* const b = static_cast<const int16_t*>(bias);
  int16_t* const to = static_cast<int16_t*>(features);
  const Activation<Narrow> activate(layer.slope);
  for (int i = 0; i < count; i += kGroup) {
    int16_t adds[kGroup] = {};
    for (int n = 0; n < kGroup && add != nullptr; ++n) adds[n] = Rounded16(add[i + n] * OutSteps(layer));
    Narrow::Store(to + i, activate(Narrow::Load(from + i), Narrow::Load(b + i), Narrow::Load(adds)));
  }
}

void StoreFeatures(const float* values, int count, float range, void* features) {
  int16_t* const to = static_cast<int16_t*>(features);
  for (int i = 0; i < count; ++i) {
    const float steps = values[i] * (static_cast<float>(kMost) / range);
    to[i] = Rounded16(steps < -kMost ? -kMost : steps > kMost ? kMost : steps);
  }
}

// Colours. A result row of kUp has 16 columns: two rows of two texels; of kSame the first four are a texel.
int64_t PixelBiasBytes(const PackedConvolution& layer) {
  return static_cast<int64_t>(layer.count + kRowSlack) * kGroup * 2;
}

bool PackPixelBias(const float* const* rows, const PackedConvolution& layer, void* packed) {
  int16_t* to = static_cast<int16_t*>(packed);
  const int part = layer.out_rows == 2 ? 8 : 4;
  bool fits = true;
  for (int i = 0; i < layer.count; ++i) {
    for (int n = 0; n < kGroup; ++n) {
      const float value = n < part * layer.out_rows ? rows[n / part][i * part + n % part] : 0;
      const float steps = (value + 0.5f) * kPixelSteps;  // so that cutting off rounds
      fits = fits && Fits16(steps);
      *to++ = Rounded16(steps);
    }
  }
  return fits;
}

// 16-bit colours [count][16] and their biases -> texels of both rows, kUp, `count` even or with one row of slack.
inline void UpTexels(const int16_t* sums, const int16_t* bias, int count, uint8_t* const* lines) {
  const auto colours = [&](int i) {
    return Narrow::ShiftRight<kPixelShift>(
        Narrow::Add(Narrow::Load(sums + i * kGroup), Narrow::Load(bias + i * kGroup)));
  };
  for (int i = 0; i < count; i += 2) Narrow::StoreBytes(lines[0] + 8 * i, lines[1] + 8 * i, colours(i), colours(i + 1));
}

inline void HalfTexels(const int16_t* sums, const int16_t* bias, int count, Half* to) {
  float colours[4];
  for (int i = 0; i < count; i += 4) {
    for (int c = 0; c < 4; ++c) {
      // Biases hold half a step of 8-bit colours more.
      colours[c] = (static_cast<float>(sums[i + c]) + bias[i + c]) * (1 / kPixelSteps) - 0.5f;
    }
    ConvertToHalf(colours, 4, to + i);
  }
}

// Texels of a chunk's result rows, to lines that begin with the first of them.
void Texels(const PixelJob& job, const int16_t* sums, const int16_t* bias, int count, uint8_t* const* lines) {
  const bool up = job.layer->out_rows == 2, half = job.format == PixelFormat::kRgba16F;
  if (up && !half) return UpTexels(sums, bias, count, lines);
  const int part = up ? 8 : 4;
  for (int i = 0; i < count; ++i, sums += kGroup, bias += kGroup) {
    for (int r = 0; r < job.layer->out_rows; ++r) {
      if (half) {
        HalfTexels(sums + r * part, bias + r * part, part, reinterpret_cast<Half*>(lines[r]) + i * part);
        continue;
      }
      for (int c = 0; c < part; ++c) {
        const int value = (sums[r * part + c] + bias[r * part + c]) >> kPixelShift;
        lines[r][i * part + c] = static_cast<uint8_t>(value < 0 ? 0 : value > 255 ? 255 : value);
      }
    }
  }
}

void Pixels(const PixelJob& job, void* scratch) {
  const PackedConvolution& layer = *job.layer;
  const Product product = ProductOf(job.in, layer);
  int16_t* const sums = static_cast<int16_t*>(scratch);  // [kChunk and some][16]
  const int texel_bytes = job.format == PixelFormat::kRgba8 ? 4 : 8, texels = layer.out_rows;
  uint8_t* const line = reinterpret_cast<uint8_t*>(sums + (kChunk + kRowSlack) * kGroup);
  const int64_t pitch = static_cast<int64_t>(layer.count + kRowSlack) * texels * texel_bytes;
  for (int row = 0; row < layer.count; row += kChunk) {
    const int end = layer.count - row < kChunk ? layer.count : row + kChunk;
    MultiplyPanel<Narrow>(product, PanelWeights(layer, 0), row, end,
                          [&](int i, Narrow::Type values) { Narrow::Store(sums + (i - row) * kGroup, values); });
    uint8_t* const first = line + static_cast<int64_t>(row) * texels * texel_bytes;
    uint8_t* const lines[2] = {first, first + pitch};
    Texels(job, sums, static_cast<const int16_t*>(job.bias) + static_cast<int64_t>(row) * kGroup, end - row, lines);
  }
  for (int r = 0; r < layer.out_rows; ++r) {
    if (job.pixels[r] == nullptr) continue;
    const uint8_t* const from = line + r * pitch - static_cast<int64_t>(job.first_texel) * texel_bytes;
    __builtin_memcpy(job.pixels[r], from, static_cast<size_t>(job.size) * texel_bytes);
  }
}

}  // namespace
}  // namespace likeness
