// bfloat16 on AMX, the processor's unit for products of 16 x 32 by 32 x 16 tiles.
//
// A left tile is read straight from the rows of features: its row is a result row's window. Of two column tiles that
// belong together the first has the even columns, the second the odd ones, so that two vectors of results become one of
// bfloat16 pairs by a shift and a mask. Features are cut off, not rounded, to 16 bits: this makes them smaller by 0.28%
// on average, which the weights that meet them undo.

#include <immintrin.h>
#include <sys/syscall.h>
#include <unistd.h>

#define LIKENESS_VECTOR_BYTES 64
#define LIKENESS_HALF
#include "likeness/decode/avx512_impl.h"
#include "likeness/decode/pixels_impl.h"

namespace likeness {
namespace {

constexpr int kSide = 16;   // rows of a tile, and float columns of a result
constexpr int kInner = 32;  // bfloat16 values in a tile's row
constexpr int kTile = kSide * kInner;
constexpr float kUncut = 1.00282f;
constexpr float kPixelSteps = 64;     // colours are summed in 16-bit fixed point of this many steps
constexpr int kPixelShift = 6;        // its logarithm
constexpr int kPrefetchBytes = 2048;  // biases come from far away

struct alignas(64) TileConfig {
  uint8_t palette = 1;
  uint8_t start_row = 0;
  uint8_t reserved[14] = {};
  uint16_t row_bytes[16] = {64, 64, 64, 64, 64, 64, 64, 64};
  uint8_t rows[16] = {16, 16, 16, 16, 16, 16, 16, 16};
};

unsigned EnterTiles() {
  // Not _tile_loadconfig: that of GCC 12 says that it reads 8 bytes, and the others' writes are optimised away.
  const TileConfig config;
  __asm__ volatile("ldtilecfg %0" ::"m"(config));
  return Enter();
}
void LeaveTiles(unsigned mode) {
  _tile_release();
  Leave(mode);
}

// Asks the system for the tiles' state; false where processor or system have none. Threads inherit the permission.
bool PermitTiles() {
  unsigned eax = 7, ebx = 0, ecx = 0, edx = 0;
  __asm__ volatile("cpuid" : "+a"(eax), "=b"(ebx), "+c"(ecx), "=d"(edx));
  constexpr unsigned kBf16Bit = 1u << 22, kTileBit = 1u << 24;
  if ((edx & kBf16Bit) == 0 || (edx & kTileBit) == 0) return false;
  constexpr long kRequestPermission = 0x1023, kTileData = 18;
  return syscall(SYS_arch_prctl, kRequestPermission, kTileData) == 0;
}
bool Available() { return HasAvx512() && PermitTiles(); }

inline uint16_t ToBf16(float value) {
  const uint32_t bits = __builtin_bit_cast(uint32_t, value);
  return static_cast<uint16_t>((bits + 0x7fff + ((bits >> 16) & 1)) >> 16);
}

inline int DepthTiles(const PackedConvolution& layer) { return (layer.depth + kInner - 1) / kInner; }
inline bool Paired(const PackedConvolution& layer) { return layer.columns % (2 * kSide) == 0; }

int64_t TileWeightBytes(const PackedConvolution& layer) {
  return static_cast<int64_t>(layer.in_rows) * DepthTiles(layer) * kTile * (layer.columns / kSide) * 2;
}

// [column tile or pair of them][row][k tile][1 or 2][k / 2][column][2]
void PackTiles(const float* weights, const PackedConvolution& layer, void* packed) {
  uint16_t* to = static_cast<uint16_t*>(packed);
  const int tiles = Paired(layer) ? 2 : 1;
  const float scale = kUncut * (layer.colours && layer.out_rows == 2 ? kPixelSteps : 1.0f);
  for (int n0 = 0; n0 < layer.columns; n0 += tiles * kSide) {
    for (int r = 0; r < layer.in_rows; ++r) {
      for (int k0 = 0; k0 < layer.depth; k0 += kInner) {
        for (int t = 0; t < tiles; ++t) {
          for (int i = 0; i < kTile; ++i) {
            const int k = k0 + i / kInner * 2 + i % 2, n = n0 + i % kInner / 2 * tiles + t;
            const int64_t row = static_cast<int64_t>(r) * layer.depth + k;
            *to++ = k < layer.depth ? ToBf16(weights[row * layer.columns + n] * scale) : 0;
          }
        }
      }
    }
  }
}

bool PackTileBias(const float* values, int count, void* packed) {
  for (int i = 0; i < count; ++i) static_cast<uint16_t*>(packed)[i] = ToBf16(values[i]);
  return true;
}

// Sixteen channels, or the even ones of 32 and the odd ones.
inline __m512 Even(__m512i pairs) { return _mm512_castsi512_ps(_mm512_slli_epi32(pairs, 16)); }
inline __m512 Odd(__m512i pairs) {
  return _mm512_castsi512_ps(_mm512_and_si512(pairs, _mm512_set1_epi32(static_cast<int>(0xffff0000))));
}
inline __m512i Pairs(__m512 even, __m512 odd) {
  constexpr int kSelect = 0xf8;  // a | (b & c)
  return _mm512_ternarylogic_epi32(_mm512_srli_epi32(_mm512_castps_si512(even), 16), _mm512_castps_si512(odd),
                                   _mm512_set1_epi32(static_cast<int>(0xffff0000)), kSelect);
}
inline __m512 Activate(__m512 v, __m512 slope) { return _mm512_max_ps(v, _mm512_mul_ps(v, slope)); }

// Finishes 32 columns of one result row.
inline void FinishPair(const float* even, const float* odd, const uint16_t* bias, const __m512* add, __m512 slope,
                       uint16_t* to) {
  const __m512i b = _mm512_loadu_si512(bias);
  __m512 e = Activate(_mm512_add_ps(_mm512_load_ps(even), Even(b)), slope);
  __m512 o = Activate(_mm512_add_ps(_mm512_load_ps(odd), Odd(b)), slope);
  if (add != nullptr) e = _mm512_add_ps(e, add[0]), o = _mm512_add_ps(o, add[1]);
  _mm512_storeu_si512(to, Pairs(e, o));
}

inline void LoadAdd(const float* from, __m512 add[2]) {
  const __m512 low = _mm512_loadu_ps(from), high = _mm512_loadu_ps(from + 16);
  const __m512i even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  add[0] = _mm512_permutex2var_ps(low, even, high);
  add[1] = _mm512_permutex2var_ps(low, _mm512_add_epi32(even, _mm512_set1_epi32(1)), high);
}

// One result row of 16 channels, in their order.
inline void FinishSixteen(const float* sums, const uint16_t* bias, const float* add, __m512 slope, uint16_t* to) {
  const __m512i b = _mm512_cvtepu16_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(bias)));
  __m512 v = Activate(_mm512_add_ps(_mm512_loadu_ps(sums), Even(b)), slope);
  if (add != nullptr) v = _mm512_add_ps(v, _mm512_loadu_ps(add));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                      _mm512_cvtepi32_epi16(_mm512_srli_epi32(_mm512_castps_si512(v), 16)));
}

// Sums of column tiles as they are packed, [result row][columns]: of a pair the even columns stand before the odd ones.
void Multiply(const void* const* in, const PackedConvolution& layer, int first, int columns, int row, int count,
              float* out) {
  const int64_t step = static_cast<int64_t>(layer.channels) * 2, pitch = static_cast<int64_t>(columns) * 4;
  const int depth = DepthTiles(layer), tiles = Paired(layer) ? 2 : 1;
  const int64_t panel = static_cast<int64_t>(layer.in_rows) * depth * kTile;
  for (int n = 0; n < columns; n += tiles * kSide) {
    const uint16_t* const panels = static_cast<const uint16_t*>(layer.weights) + (first + n) / kSide * panel;
    for (int i = 0; i < count; i += 2 * kSide) {
      const bool two = i + kSide < count;
      const uint16_t* weights = panels;
      _tile_zero(0);
      _tile_zero(1);
      _tile_zero(2);
      _tile_zero(3);
      for (int r = 0; r < layer.in_rows; ++r) {
        const uint16_t* a = static_cast<const uint16_t*>(in[r]) + static_cast<int64_t>(row + i) * layer.channels;
        for (int k = 0; k < depth; ++k, a += kInner, weights += tiles * kTile) {
          _tile_loadd(4, a, step);
          _tile_loadd(6, weights, 64);
          _tile_dpbf16ps(0, 4, 6);
          if (two) {
            _tile_loadd(5, a + static_cast<int64_t>(kSide) * layer.channels, step);
            _tile_dpbf16ps(2, 5, 6);
          }
          if (tiles == 2) {
            _tile_loadd(7, weights + kTile, 64);
            _tile_dpbf16ps(1, 4, 7);
            if (two) _tile_dpbf16ps(3, 5, 7);
          }
        }
      }
      float* const to = out + static_cast<int64_t>(i) * columns + n;
      _tile_stored(0, to, pitch);
      if (tiles == 2) _tile_stored(1, to + kSide, pitch);
      if (two) _tile_stored(2, to + static_cast<int64_t>(kSide) * columns, pitch);
      if (two && tiles == 2) _tile_stored(3, to + static_cast<int64_t>(kSide) * columns + kSide, pitch);
    }
  }
}

void Block(const BlockJob& job, float* sums) {
  Multiply(job.in, *job.layer, job.first_column, job.columns, 0, job.count, sums);
}

void Finish(const float* sums, const void* bias, const float* add, float slope, int count, void* features) {
  const __m512 slopes = _mm512_set1_ps(slope);
  for (int i = 0; i < count; i += 2 * kSide) {
    __m512 added[2];
    if (add != nullptr) LoadAdd(add + i, added);
    FinishPair(sums + i, sums + i + kSide, static_cast<const uint16_t*>(bias) + i, add != nullptr ? added : nullptr,
               slopes, static_cast<uint16_t*>(features) + i);
  }
}

// kSame: one part. Sums of a few rows, then what follows.
void SameRows(const RowJob& job, void* scratch) {
  const PackedConvolution& layer = *job.layer;
  const __m512 slope = _mm512_set1_ps(layer.slope);
  float* const sums = static_cast<float*>(scratch);
  for (int row = 0; row < layer.count; row += kInner) {
    const int count = layer.count - row < kInner ? layer.count - row : kInner;
    Multiply(job.in, layer, 0, layer.columns, row, count, sums);
    const int64_t at = static_cast<int64_t>(row) * layer.columns;
    const uint16_t* const bias = static_cast<const uint16_t*>(job.bias[0]) + at;
    uint16_t* const to = static_cast<uint16_t*>(job.out[0]) + at;
    for (int i = 0; i < count; ++i) {
      const int64_t from = static_cast<int64_t>(i) * layer.columns;
      if (Paired(layer)) {
        Finish(sums + from, bias + from, job.add, layer.slope, layer.columns, to + from);
      } else {
        for (int n = 0; n < layer.columns; n += kSide) {
          FinishSixteen(sums + from + n, bias + from + n, job.add != nullptr ? job.add + n : nullptr, slope,
                        to + from + n);
        }
      }
    }
  }
}

// kUp: units of 16 result rows x 32 columns. While one unit is multiplied, the one before it is stored, and the one
// before that finished: storing tiles waits for them, and vector code does not.
struct Unit {
  const uint16_t* a[2] = {};
  const uint16_t* weights = nullptr;
  const uint16_t* bias = nullptr;
  int column = 0;  // of the part
  uint16_t* out = nullptr;
};

struct UpRows {
  const RowJob& job;
  const int pairs, part, part_pairs, depth;
  const int64_t step;
  const __m512 slope;
  float* const scratch;  // two units of two tiles

  Unit At(int index) const {
    const int rows = index / pairs * kSide, pair = index % pairs, r = pair >= part_pairs ? 1 : 0;
    const int64_t window = static_cast<int64_t>(rows) * job.layer->channels;
    const int column = (pair - r * part_pairs) * kInner;
    const int64_t at = static_cast<int64_t>(rows) * part + column;
    Unit unit;
    for (int dy = 0; dy < 2; ++dy) unit.a[dy] = static_cast<const uint16_t*>(job.in[dy]) + window;
    unit.weights =
        static_cast<const uint16_t*>(job.layer->weights) + static_cast<int64_t>(pair) * 2 * depth * 2 * kTile;
    unit.bias = static_cast<const uint16_t*>(job.bias[r]) + at;
    unit.out = static_cast<uint16_t*>(job.out[r]) + at;
    unit.column = column;
    return unit;
  }

  template <int kFirst>
  void Store() const {
    float* const to = scratch + kFirst * kSide * kSide;
    if constexpr (kFirst == 0) {
      _tile_stored(0, to, 64);
      _tile_stored(1, to + kSide * kSide, 64);
    } else {
      _tile_stored(2, to, 64);
      _tile_stored(3, to + kSide * kSide, 64);
    }
  }

  // Rows [begin, end) of the unit whose sums lie at `from`.
  inline void FinishRows(const Unit& unit, const float* from, int begin, int end) const {
    __m512 add[2];
    if (job.add != nullptr) LoadAdds(unit.column, add);
    for (int i = begin; i < end; ++i) {
      const uint16_t* const bias = unit.bias + static_cast<int64_t>(i) * part;
      _mm_prefetch(reinterpret_cast<const char*>(bias) + kPrefetchBytes, _MM_HINT_T0);
      FinishPair(from + i * kSide, from + (kSide + i) * kSide, bias, job.add != nullptr ? add : nullptr, slope,
                 unit.out + static_cast<int64_t>(i) * part);
    }
  }

  // The 32 columns may be of two texels.
  void LoadAdds(int column, __m512 add[2]) const {
    alignas(64) float values[kInner];
    for (int c = 0; c < kInner; ++c) values[c] = job.add[(column + c) % job.add_count];
    LoadAdd(values, add);
  }

  // kFirst: 0 or 2, the first of the two tiles that collect this unit.
  template <int kFirst, int kDepth>
  inline void Step(const Unit& now, const Unit& finished, bool store, bool finish) const {
    if (store) Store<2 - kFirst>();
    const float* const from = scratch + kFirst * kSide * kSide;
    const int tiles = kDepth > 0 ? kDepth : depth;
    const uint16_t* weights = now.weights;
    int row = 0;
    if constexpr (kFirst == 0) {
      _tile_zero(0);
      _tile_zero(1);
    } else {
      _tile_zero(2);
      _tile_zero(3);
    }
    const int rows_a_step = kDepth > 0 ? kSide / (2 * kDepth) : 0;
    for (int dy = 0; dy < 2; ++dy) {
      const uint16_t* a = now.a[dy];
#pragma GCC unroll 4
      for (int k = 0; k < tiles; ++k, a += kInner, weights += 2 * kTile) {
        _tile_loadd(4, a, step);
        _tile_loadd(6, weights, 64);
        _tile_loadd(7, weights + kTile, 64);
        if constexpr (kFirst == 0) {
          _tile_dpbf16ps(0, 4, 6);
          _tile_dpbf16ps(1, 4, 7);
        } else {
          _tile_dpbf16ps(2, 4, 6);
          _tile_dpbf16ps(3, 4, 7);
        }
        if (rows_a_step > 0 && finish) {
          FinishRows(finished, from, row, row + rows_a_step);
          row += rows_a_step;
        }
      }
    }
    if (finish) FinishRows(finished, from, row, kSide);
  }

  template <int kDepth>
  void Run(int units) const {
    Unit before[2];  // the last units of each parity
    for (int u = 0; u < units; u += 2) {
      const Unit even = At(u), odd = At(u + 1);
      Step<0, kDepth>(even, before[0], u > 0, u > 0);
      before[0] = even;
      Step<2, kDepth>(odd, before[1], true, u > 0);
      before[1] = odd;
    }
    Store<2>();
    FinishRows(before[0], scratch, 0, kSide);
    FinishRows(before[1], scratch + 2 * kSide * kSide, 0, kSide);
  }
};

void Rows(const RowJob& job, void* scratch) {
  const PackedConvolution& layer = *job.layer;
  if (layer.out_rows == 1) return SameRows(job, scratch);
  const int pairs = layer.columns / kInner, depth = DepthTiles(layer);
  const UpRows rows = {job,
                       pairs,
                       layer.columns / 2,
                       pairs / 2,
                       depth,
                       static_cast<int64_t>(layer.channels) * 2,
                       _mm512_set1_ps(layer.slope),
                       static_cast<float*>(scratch)};
  const int units = (layer.count + kSide - 1) / kSide * pairs;  // even, as pairs is
  if (depth == 1) return rows.Run<1>(units);
  if (depth == 2) return rows.Run<2>(units);
  if (depth == 4) return rows.Run<4>(units);
  rows.Run<0>(units);
}

// Colours of kUp, 16 columns: two rows' two texels. For four result rows, sums become 16-bit by two packs, in the order
// (row 0, texel 0), (0, 1), (1, 0), (1, 1), each with two result rows; the biases lie in this order.
int64_t TilePixelBiasBytes(const PackedConvolution& layer) {
  if (layer.out_rows == 1) return PixelBiasBytes(layer);
  return static_cast<int64_t>(layer.count + kRowSlack) * kSide * 2;
}

bool PackTilePixelBias(const float* const* rows, const PackedConvolution& layer, void* packed) {
  if (layer.out_rows == 1) return PackPixelBias(rows, layer, packed);
  int16_t* to = static_cast<int16_t*>(packed);
  bool fits = true;
  const int end = (layer.count + kSide - 1) / kSide * kSide;
  for (int i = 0; i < end; i += 2) {
    for (int piece = 0; piece < 4; ++piece) {
      for (int v = 0; v < 8; ++v) {
        const int row = i + v / 4;
        const float value = row < layer.count ? rows[piece / 2][(2 * row + piece % 2) * 4 + v % 4] : 0;
        const float steps = (value + 0.5f) * kPixelSteps;  // so that cutting off rounds
        fits = fits && steps > -32767 && steps < 32767;
        const float kept = fits ? steps : 0;
        *to++ = static_cast<int16_t>(kept < 0 ? kept - 0.5f : kept + 0.5f);
      }
    }
  }
  return fits;
}

// 16 result rows to two lines.
template <bool kHalf>
inline void FinishPixels(const float* sums, const int16_t* bias, uint8_t* const lines[2]) {
  const __m512i order = _mm512_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7, 8, 12, 9, 13, 10, 14, 11, 15);
  for (int i = 0; i < kSide; i += 4) {
    _mm_prefetch(reinterpret_cast<const char*>(bias + i * kSide) + kPrefetchBytes, _MM_HINT_T0);
    _mm_prefetch(reinterpret_cast<const char*>(bias + i * kSide) + kPrefetchBytes + 64, _MM_HINT_T0);
    const auto sum = [&](int row) { return _mm512_cvtps_epi32(_mm512_load_ps(sums + (i + row) * kSide)); };
    const auto two = [&](int row) {
      return _mm512_adds_epi16(_mm512_packs_epi32(sum(row), sum(row + 1)),
                               _mm512_loadu_si512(bias + (i + row) * kSide));
    };
    const __m512i first = two(0), second = two(2);
    if constexpr (!kHalf) {
      const __m512i bytes = _mm512_permutexvar_epi32(
          order, _mm512_packus_epi16(_mm512_srai_epi16(first, kPixelShift), _mm512_srai_epi16(second, kPixelShift)));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(lines[0] + i * 8), _mm512_castsi512_si256(bytes));
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(lines[1] + i * 8), _mm512_extracti64x4_epi64(bytes, 1));
    } else {
      // Texels of 4 x 16 bits, in the pieces' order: [piece][result row]
      const __m512i rows01 = _mm512_setr_epi64(0, 2, 1, 3, 4, 6, 5, 7);
      const __m512i texels[2] = {_mm512_permutexvar_epi64(rows01, first), _mm512_permutexvar_epi64(rows01, second)};
      for (int half = 0; half < 2; ++half) {
        for (int r = 0; r < 2; ++r) {
          const __m256i part =
              r == 0 ? _mm512_castsi512_si256(texels[half]) : _mm512_extracti64x4_epi64(texels[half], 1);
          const __m512 value = _mm512_sub_ps(_mm512_cvtepi32_ps(_mm512_cvtepi16_epi32(part)), _mm512_set1_ps(32));
          const __m256i out =
              _mm512_cvtps_ph(_mm512_mul_ps(value, _mm512_set1_ps(1 / (255 * kPixelSteps))), _MM_FROUND_TO_NEAREST_INT);
          _mm256_storeu_si256(reinterpret_cast<__m256i*>(lines[r] + i * 16 + half * 32), out);
        }
      }
    }
  }
}

template <bool kHalf>
inline void UpPixels(const PixelJob& job, void* scratch) {
  const PackedConvolution& layer = *job.layer;
  constexpr int kTexelBytes = kHalf ? 8 : 4;
  float* const sums = static_cast<float*>(scratch);  // two units of a tile
  uint8_t* const line = reinterpret_cast<uint8_t*>(sums + 2 * kSide * kSide);
  const int64_t pitch = static_cast<int64_t>(2 * (layer.count + kRowSlack)) * kTexelBytes;
  const int64_t step = static_cast<int64_t>(layer.channels) * 2;
  const uint16_t* const weights = static_cast<const uint16_t*>(layer.weights);
  const int depth = DepthTiles(layer), units = (layer.count + kSide - 1) / kSide;
  const bool held = depth == 1;
  if (held) {
    _tile_loadd(6, weights, 64);
    _tile_loadd(7, weights + kTile, 64);
  }
  const auto finish = [&](int unit) {
    uint8_t* const lines[2] = {line + static_cast<int64_t>(unit) * 2 * kSide * kTexelBytes,
                               line + pitch + static_cast<int64_t>(unit) * 2 * kSide * kTexelBytes};
    FinishPixels<kHalf>(sums + unit % 2 * kSide * kSide,
                        static_cast<const int16_t*>(job.bias) + static_cast<int64_t>(unit) * kSide * kSide, lines);
  };
  const auto window = [&](int dy, int unit) {
    return static_cast<const uint16_t*>(job.in[dy]) + static_cast<int64_t>(unit) * kSide * layer.channels;
  };
  // The same three stages as above.
  for (int unit = 0; unit < units + 2; ++unit) {
    const bool even = unit % 2 == 0;
    if (unit > 0 && unit <= units) {
      if (even) {
        _tile_stored(1, sums + kSide * kSide, 64);
      } else {
        _tile_stored(0, sums, 64);
      }
    }
    if (unit < units) {
      if (even) {
        _tile_zero(0);
      } else {
        _tile_zero(1);
      }
      for (int dy = 0; dy < 2; ++dy) {
        for (int k = 0; k < depth; ++k) {
          _tile_loadd(4, window(dy, unit) + k * kInner, step);
          if (!held) _tile_loadd(6, weights + static_cast<int64_t>(dy * depth + k) * kTile, 64);
          if (even) {
            if (held && dy == 1) {
              _tile_dpbf16ps(0, 4, 7);
            } else {
              _tile_dpbf16ps(0, 4, 6);
            }
          } else {
            if (held && dy == 1) {
              _tile_dpbf16ps(1, 4, 7);
            } else {
              _tile_dpbf16ps(1, 4, 6);
            }
          }
        }
      }
    }
    if (unit >= 2) finish(unit - 2);
  }
  for (int r = 0; r < 2; ++r) {
    if (job.pixels[r] == nullptr) continue;
    const uint8_t* const from = line + r * pitch - static_cast<int64_t>(job.first_texel) * kTexelBytes;
    __builtin_memcpy(job.pixels[r], from, static_cast<size_t>(job.size) * kTexelBytes);
  }
}

void TilePixels(const PixelJob& job, void* scratch) {
  if (job.layer->out_rows == 1) return Pixels(job, scratch);
  if (job.format == PixelFormat::kRgba16F) return UpPixels<true>(job, scratch);
  UpPixels<false>(job, scratch);
}

void StoreFeatures(const float* values, int count, void* features) {
  uint16_t* const to = static_cast<uint16_t*>(features);
  for (int i = 0; i < count; ++i) to[i] = static_cast<uint16_t>(__builtin_bit_cast(uint32_t, values[i]) >> 16);
}

}  // namespace

extern const Kernel kKernel_amx;
const Kernel kKernel_amx = {"amx",
                            false,
                            2,
                            2,
                            2,
                            Available,
                            EnterTiles,
                            LeaveTiles,
                            TileWeightBytes,
                            PackTiles,
                            PackTileBias,
                            TilePixelBiasBytes,
                            PackTilePixelBias,
                            PackDense,
                            StoreFeatures,
                            Rows,
                            TilePixels,
                            Block,
                            Finish,
                            Dense,
                            Convert};

}  // namespace likeness
