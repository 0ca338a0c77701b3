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
bool PackTiles(const float* weights, const PackedConvolution& layer, void* packed) {
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
  return true;
}

// The odd one of a pair is read with the even one's bits below its own, so it is the value that comes nearest with
// them.
bool PackTileBias(const PackedConvolution&, const float* values, int count, void* packed) {
  uint16_t* const to = static_cast<uint16_t*>(packed);
  for (int i = 0; i < count; ++i) {
    to[i] = ToBf16(values[i]);
    if (i % 2 == 0) continue;
    const uint32_t bits = __builtin_bit_cast(uint32_t, values[i]);
    const auto distance = [&](uint32_t upper) {
      const float read = __builtin_bit_cast(float, upper << 16 | to[i - 1]);
      return read < values[i] ? values[i] - read : read - values[i];
    };
    const uint32_t high = bits >> 16;
    uint32_t best = high;
    if (high % 0x8000 != 0 && distance(high - 1) < distance(best)) best = high - 1;
    if (high % 0x8000 < 0x7f00 && distance(high + 1) < distance(best)) best = high + 1;
    to[i] = static_cast<uint16_t>(best);
  }
  return true;
}

// Sixteen channels, or the even ones of 32 and the odd ones.
inline __m512 Even(__m512i pairs) { return _mm512_castsi512_ps(_mm512_slli_epi32(pairs, 16)); }
inline __m512 Odd(__m512i pairs) { return _mm512_castsi512_ps(pairs); }
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

void Finish(const PackedConvolution& layer, const float* sums, const void* bias, const float* add, int count,
            void* features) {
  const __m512 slopes = _mm512_set1_ps(layer.slope);
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
        Finish(layer, sums + from, bias + from, job.add, layer.columns, to + from);
      } else {
        for (int n = 0; n < layer.columns; n += kSide) {
          FinishSixteen(sums + from + n, bias + from + n, job.add != nullptr ? job.add + n : nullptr, slope,
                        to + from + n);
        }
      }
    }
  }
}

// kUp: units of 16 result rows x 32 columns. The products of one unit, the storing of tiles and the vector code that
// finishes an earlier unit are interleaved: the processor overlaps them only where they stand close together.
struct UpRows {
  const RowJob& job;
  const int pairs, part, depth, m_tiles;
  const int64_t step;
  const __m512 slope;
  float* const sums;  // of the last few units: [kSlots][2][16][16]
  float* const adds;  // [part], the even channels of 32 before the odd ones

  static constexpr int kSlots = 4;

  float* Slot(int unit) const { return sums + unit % kSlots * (2 * kSide * kSide); }
  const uint16_t* A(int dy, int m) const {
    return static_cast<const uint16_t*>(job.in[dy]) + static_cast<int64_t>(m) * kSide * job.layer->channels;
  }
  const uint16_t* Weights(int pair) const {
    return static_cast<const uint16_t*>(job.layer->weights) + static_cast<int64_t>(pair) * 2 * depth * 2 * kTile;
  }

  // Where a unit's results go.
  struct Target {
    const uint16_t* bias = nullptr;
    uint16_t* out = nullptr;
    const float* add = nullptr;
    const float* from = nullptr;
  };
  Target TargetOf(int m, int pair, int unit) const {
    const int r = pair >= pairs / 2 ? 1 : 0, column = (pair - r * (pairs / 2)) * kInner;
    const int64_t at = static_cast<int64_t>(m) * kSide * part + column;
    return {static_cast<const uint16_t*>(job.bias[r]) + at, static_cast<uint16_t*>(job.out[r]) + at, adds + column,
            Slot(unit)};
  }

  // Result rows [begin, begin + kCount) of a unit.
  template <bool kAdd, int kCount>
  __attribute__((always_inline)) inline void FinishRows(const Target& to, int begin) const {
    __m512 add[2];
    if constexpr (kAdd) add[0] = _mm512_loadu_ps(to.add), add[1] = _mm512_loadu_ps(to.add + kSide);
#pragma GCC unroll 16
    for (int i = begin; i < begin + kCount; ++i) {
      const uint16_t* const bias = to.bias + static_cast<int64_t>(i) * part;
      _mm_prefetch(reinterpret_cast<const char*>(bias) + kPrefetchBytes, _MM_HINT_T0);
      FinishPair(to.from + i * kSide, to.from + (kSide + i) * kSide, bias, kAdd ? add : nullptr, slope,
                 to.out + static_cast<int64_t>(i) * part);
    }
  }

  // 16 channels: the weights of 32 columns are four tiles, which stay where they are for the whole row.
  template <bool kAdd, bool kFinish>
  __attribute__((always_inline)) inline void HeldStep(int m, const Target& to) const {
    _tile_zero(0);
    _tile_loadd(2, A(0, m), step);
    if constexpr (kFinish) FinishRows<kAdd, 2>(to, 0);
    _tile_loadd(3, A(1, m), step);
    if constexpr (kFinish) FinishRows<kAdd, 2>(to, 2);
    _tile_dpbf16ps(0, 2, 4);
    if constexpr (kFinish) FinishRows<kAdd, 2>(to, 4);
    _tile_dpbf16ps(0, 3, 6);
    if constexpr (kFinish) FinishRows<kAdd, 2>(to, 6);
    _tile_stored(1, Slot(m + kSlots - 1) + kSide * kSide, 64);
    _tile_zero(1);
    if constexpr (kFinish) FinishRows<kAdd, 2>(to, 8);
    _tile_dpbf16ps(1, 2, 5);
    if constexpr (kFinish) FinishRows<kAdd, 2>(to, 10);
    _tile_dpbf16ps(1, 3, 7);
    if constexpr (kFinish) FinishRows<kAdd, 2>(to, 12);
    _tile_stored(0, Slot(m), 64);
    if constexpr (kFinish) FinishRows<kAdd, 2>(to, 14);
  }

  template <bool kAdd>
  void RunHeld() const {
    for (int pair = 0; pair < pairs; ++pair) {
      const uint16_t* const weights = Weights(pair);
      _tile_loadd(4, weights, 64);
      _tile_loadd(5, weights + kTile, 64);
      _tile_loadd(6, weights + 2 * kTile, 64);
      _tile_loadd(7, weights + 3 * kTile, 64);
      for (int m = 0; m < m_tiles; ++m) {
        if (m < 2) {
          HeldStep<kAdd, false>(m, {});
        } else {
          HeldStep<kAdd, true>(m, TargetOf(m - 2, pair, m - 2));
        }
      }
      _tile_stored(1, Slot(m_tiles + kSlots - 1) + kSide * kSide, 64);
      if (m_tiles > 1) FinishRows<kAdd, kSide>(TargetOf(m_tiles - 2, pair, m_tiles - 2), 0);
      FinishRows<kAdd, kSide>(TargetOf(m_tiles - 1, pair, m_tiles - 1), 0);
    }
  }

  // More channels. kDepth: k tiles of an input row, 0 where there are many.
  template <bool kAdd, int kDepth, bool kFinish>
  __attribute__((always_inline)) inline void Step(int m, int pair, int unit, const Target& to) const {
    const int tiles = kDepth > 0 ? kDepth : depth;
    constexpr int kRowsAStep = kDepth > 0 ? kSide / (4 * kDepth) : 0;
    const uint16_t* weights = Weights(pair);
    _tile_zero(0);
    _tile_zero(1);
    int row = 0;
    for (int dy = 0; dy < 2; ++dy) {
      const uint16_t* a = A(dy, m);
#pragma GCC unroll 4
      for (int k = 0; k < tiles; ++k, a += kInner, weights += 2 * kTile) {
        _tile_loadd(4, a, step);
        _tile_loadd(6, weights, 64);
        _tile_dpbf16ps(0, 4, 6);
        if constexpr (kFinish && kDepth > 0) FinishRows<kAdd, kRowsAStep>(to, row);
        _tile_loadd(7, weights + kTile, 64);
        _tile_dpbf16ps(1, 4, 7);
        if constexpr (kFinish && kDepth > 0) FinishRows<kAdd, kRowsAStep>(to, row + kRowsAStep);
        row += 2 * kRowsAStep;
      }
    }
    _tile_stored(0, Slot(unit), 64);
    _tile_stored(1, Slot(unit) + kSide * kSide, 64);
    if constexpr (kFinish && kDepth == 0) FinishRows<kAdd, kSide>(to, 0);
  }

  template <bool kAdd, int kDepth>
  void Run() const {
    Target before[2];  // the last two units
    int unit = 0;
    for (int m = 0; m < m_tiles; ++m) {
      for (int pair = 0; pair < pairs; ++pair, ++unit) {
        if (unit < 2) {
          Step<kAdd, kDepth, false>(m, pair, unit, {});
        } else {
          Step<kAdd, kDepth, true>(m, pair, unit, before[0]);
        }
        before[0] = before[1];
        before[1] = TargetOf(m, pair, unit);
      }
    }
    FinishRows<kAdd, kSide>(before[0], 0);  // there are at least two: pairs is even
    FinishRows<kAdd, kSide>(before[1], 0);
  }

  template <bool kAdd>
  void RunByDepth() const {
    if (depth == 1) return RunHeld<kAdd>();
    if (depth == 2) return Run<kAdd, 2>();
    if (depth == 4) return Run<kAdd, 4>();
    Run<kAdd, 0>();
  }
};

void Rows(const RowJob& job, void* scratch) {
  const PackedConvolution& layer = *job.layer;
  if (layer.out_rows == 1) return SameRows(job, scratch);
  float* const sums = static_cast<float*>(scratch);
  float* const adds = sums + UpRows::kSlots * 2 * kSide * kSide;
  const UpRows rows = {job,
                       layer.columns / kInner,
                       layer.columns / 2,
                       DepthTiles(layer),
                       (layer.count + kSide - 1) / kSide,
                       static_cast<int64_t>(layer.channels) * 2,
                       _mm512_set1_ps(layer.slope),
                       sums,
                       adds};
  if (job.add == nullptr) return rows.RunByDepth<false>();
  for (int n = 0; n < rows.part; ++n) {
    const int within = n % kInner;
    adds[n - within + within / 2 + within % 2 * kSide] = job.add[n % job.add_count];
  }
  rows.RunByDepth<true>();
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

// Four result rows, from row i of a unit on, to two lines.
template <bool kHalf>
__attribute__((always_inline)) inline void FinishPixels(const float* sums, const int16_t* bias, uint8_t* const* lines,
                                                        int i) {
  const __m512i order = _mm512_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7, 8, 12, 9, 13, 10, 14, 11, 15);
  _mm_prefetch(reinterpret_cast<const char*>(bias + i * kSide) + kPrefetchBytes, _MM_HINT_T0);
  _mm_prefetch(reinterpret_cast<const char*>(bias + i * kSide) + kPrefetchBytes + 64, _MM_HINT_T0);
  const auto sum = [&](int row) { return _mm512_cvtps_epi32(_mm512_load_ps(sums + (i + row) * kSide)); };
  const auto two = [&](int row) {
    return _mm512_adds_epi16(_mm512_packs_epi32(sum(row), sum(row + 1)), _mm512_loadu_si512(bias + (i + row) * kSide));
  };
  const __m512i first = two(0), second = two(2);
  if constexpr (!kHalf) {
    const __m512i bytes = _mm512_permutexvar_epi32(
        order, _mm512_packus_epi16(_mm512_srai_epi16(first, kPixelShift), _mm512_srai_epi16(second, kPixelShift)));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(lines[0] + i * 8), _mm512_castsi512_si256(bytes));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(lines[1] + i * 8), _mm512_extracti64x4_epi64(bytes, 1));
  } else {
    // Texels of 4 x 16 bits: [piece][result row] -> [output row][result row][texel]
    const __m512i rows01 = _mm512_setr_epi64(0, 2, 1, 3, 4, 6, 5, 7);
    const __m512i texels[2] = {_mm512_permutexvar_epi64(rows01, first), _mm512_permutexvar_epi64(rows01, second)};
    for (int half = 0; half < 2; ++half) {
      for (int r = 0; r < 2; ++r) {
        const __m256i part = r == 0 ? _mm512_castsi512_si256(texels[half]) : _mm512_extracti64x4_epi64(texels[half], 1);
        const __m512 value = _mm512_sub_ps(_mm512_cvtepi32_ps(_mm512_cvtepi16_epi32(part)), _mm512_set1_ps(32));
        const __m256i out =
            _mm512_cvtps_ph(_mm512_mul_ps(value, _mm512_set1_ps(1 / (255 * kPixelSteps))), _MM_FROUND_TO_NEAREST_INT);
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(lines[r] + i * 16 + half * 32), out);
      }
    }
  }
}

template <bool kHalf>
struct UpPixels {
  const PixelJob& job;
  const int depth, units;
  const int64_t step;
  float* const sums;  // [kSlots][16][16]
  uint8_t* const line;
  const int64_t pitch;

  static constexpr int kSlots = 4;
  static constexpr int kTexelBytes = kHalf ? 8 : 4;

  float* Slot(int unit) const { return sums + unit % kSlots * (kSide * kSide); }
  const uint16_t* A(int dy, int unit) const {
    return static_cast<const uint16_t*>(job.in[dy]) + static_cast<int64_t>(unit) * kSide * job.layer->channels;
  }
  __attribute__((always_inline)) inline void Finish(int unit, int i) const {
    const int64_t at = static_cast<int64_t>(unit) * 2 * kSide * kTexelBytes;
    uint8_t* const lines[2] = {line + at, line + pitch + at};
    FinishPixels<kHalf>(Slot(unit), static_cast<const int16_t*>(job.bias) + static_cast<int64_t>(unit) * kSide * kSide,
                        lines, i);
  }

  // 16 channels: both tiles of weights stay where they are. Interleaved as above.
  template <bool kFinish>
  __attribute__((always_inline)) inline void HeldStep(int unit) const {
    _tile_zero(0);
    _tile_loadd(4, A(0, unit), step);
    if constexpr (kFinish) Finish(unit - 2, 0);
    _tile_dpbf16ps(0, 4, 6);
    if constexpr (kFinish) Finish(unit - 2, 4);
    _tile_loadd(5, A(1, unit), step);
    if constexpr (kFinish) Finish(unit - 2, 8);
    _tile_dpbf16ps(0, 5, 7);
    if constexpr (kFinish) Finish(unit - 2, 12);
    _tile_stored(0, Slot(unit), 64);
  }

  void Multiply(int unit) const {
    const uint16_t* weights = static_cast<const uint16_t*>(job.layer->weights);
    _tile_zero(0);
    for (int dy = 0; dy < 2; ++dy) {
      for (int k = 0; k < depth; ++k, weights += kTile) {
        _tile_loadd(4, A(dy, unit) + k * kInner, step);
        _tile_loadd(5, weights, 64);
        _tile_dpbf16ps(0, 4, 5);
      }
    }
    _tile_stored(0, Slot(unit), 64);
  }

  void FinishUnit(int unit) const {
    for (int i = 0; unit >= 0 && i < kSide; i += 4) Finish(unit, i);
  }

  void Run() const {
    if (depth == 1) {
      const uint16_t* const weights = static_cast<const uint16_t*>(job.layer->weights);
      _tile_loadd(6, weights, 64);
      _tile_loadd(7, weights + kTile, 64);
      for (int unit = 0; unit < units && unit < 2; ++unit) HeldStep<false>(unit);
      for (int unit = 2; unit < units; ++unit) HeldStep<true>(unit);
    } else {
      for (int unit = 0; unit < units; ++unit) {
        Multiply(unit);
        FinishUnit(unit - 2);
      }
    }
    FinishUnit(units - 2);
    FinishUnit(units - 1);
    for (int r = 0; r < 2; ++r) {
      if (job.pixels[r] == nullptr) continue;
      const uint8_t* const from = line + r * pitch - static_cast<int64_t>(job.first_texel) * kTexelBytes;
      __builtin_memcpy(job.pixels[r], from, static_cast<size_t>(job.size) * kTexelBytes);
    }
  }
};

template <bool kHalf>
void RunUpPixels(const PixelJob& job, void* scratch) {
  using Work = UpPixels<kHalf>;
  const PackedConvolution& layer = *job.layer;
  float* const sums = static_cast<float*>(scratch);
  const Work work = {job,
                     DepthTiles(layer),
                     (layer.count + kSide - 1) / kSide,
                     static_cast<int64_t>(layer.channels) * 2,
                     sums,
                     reinterpret_cast<uint8_t*>(sums + Work::kSlots * kSide * kSide),
                     static_cast<int64_t>(2 * (layer.count + kRowSlack)) * Work::kTexelBytes};
  work.Run();
}

void TilePixels(const PixelJob& job, void* scratch) {
  if (job.layer->out_rows == 1) return Pixels(job, scratch);
  if (job.format == PixelFormat::kRgba16F) return RunUpPixels<true>(job, scratch);
  RunUpPixels<false>(job, scratch);
}

void StoreFeatures(const float* values, int count, float, void* features) {
  uint16_t* const to = static_cast<uint16_t*>(features);
  for (int i = 0; i < count; ++i) to[i] = static_cast<uint16_t>(__builtin_bit_cast(uint32_t, values[i]) >> 16);
}

}  // namespace

extern const Kernel kKernel_amx;
const Kernel kKernel_amx = {
    .name = "amx",
    .full_precision = false,
    .fixed_point = false,
    .element_bytes = 2,
    .bias_bytes = 2,
    .dense_bytes = 2,
    .available = Available,
    .enter = EnterTiles,
    .leave = LeaveTiles,
    .weight_bytes = TileWeightBytes,
    .pack_weights = PackTiles,
    .pack_bias = PackTileBias,
    .pixel_bias_bytes = TilePixelBiasBytes,
    .pack_pixel_bias = PackTilePixelBias,
    .pack_dense = PackDense,
    .store = StoreFeatures,
    .rows = Rows,
    .pixels = TilePixels,
    .block = Block,
    .finish = Finish,
    .dense = Dense,
    .convert = Convert,
};

}  // namespace likeness
