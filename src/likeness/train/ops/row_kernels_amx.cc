// Row kernels with bfloat16 operands on AMX, the processor's unit for products of 16 x 32 by 32 x 16 tiles.
//
// Multiply's left operand is read straight from the row buffers: a tile's row is a texel's window, the step between
// rows the stride. Correlate needs the texels as the inner dimension: tiles of the small row transposed,
// [column][texel], and of the large row in pairs of texels, [texel / 2][k][2], which it lays out in its scratch memory.

#include <immintrin.h>
#include <sys/syscall.h>
#include <unistd.h>

#define LIKENESS_VECTOR_BYTES 64
#define LIKENESS_TILE 24
#define LIKENESS_BF16_BUFFERS
#include "likeness/train/ops/row_kernels_impl.h"

namespace likeness {

// Asks the system for the tiles' state; false where processor or system have none. Threads inherit the permission.
bool PermitAmx() {
  unsigned eax = 7, ebx = 0, ecx = 0, edx = 0;
  __asm__ volatile("cpuid" : "+a"(eax), "=b"(ebx), "+c"(ecx), "=d"(edx));
  constexpr unsigned kBf16Bit = 1u << 22, kTileBit = 1u << 24;
  if ((edx & kBf16Bit) == 0 || (edx & kTileBit) == 0) return false;
  constexpr long kRequestPermission = 0x1023, kTileData = 18;
  return syscall(SYS_arch_prctl, kRequestPermission, kTileData) == 0;
}

namespace {

constexpr int kSide = 16;   // rows of a tile, and float columns of a result
constexpr int kInner = 32;  // bfloat16 values in a tile's row
constexpr int kTileElements = kSide * kInner;

struct alignas(64) TileConfig {
  uint8_t palette = 1;
  uint8_t start_row = 0;
  uint8_t reserved[14] = {};
  uint16_t row_bytes[16] = {64, 64, 64, 64, 64, 64, 64, 64};
  uint8_t rows[16] = {16, 16, 16, 16, 16, 16, 16, 16};
};

// Not _tile_loadconfig: that of GCC 12 says that it reads 8 bytes, and the others' writes are optimised away.
inline void ConfigureTiles() {
  const TileConfig config;
  __asm__ volatile("ldtilecfg %0" ::"m"(config));
}

// [row][k block][column block][k / 2][column][2]
void PackWeights(const float* weights, int rows, int depth, int width, void* packed) {
  uint16_t* to = static_cast<uint16_t*>(packed);
  for (int r = 0; r < rows; ++r) {
    for (int k0 = 0; k0 < depth; k0 += kInner) {
      for (int n0 = 0; n0 < width; n0 += kSide) {
        for (int i = 0; i < kTileElements; ++i) {
          const int k = k0 + i / kInner * 2 + i % 2, n = n0 + i % kInner / 2;
          *to++ = ToBf16(weights[(static_cast<int64_t>(r) * depth + k) * width + n]);
        }
      }
    }
  }
}

// Tiles 0 to 3 hold results, 4 and 5 left operands, 6 and 7 right ones.
template <int kTexelTiles, int kColumnTiles>
inline void MultiplyTiles(const void* const* rows, int row_count, int depth, int stride, const uint16_t* packed,
                          int width, int texel, int column, float* out) {
  const int64_t step = static_cast<int64_t>(stride) * 2, block = static_cast<int64_t>(width) * kInner;
  const uint16_t* weights = packed + static_cast<int64_t>(column) * kInner;
  _tile_zero(0);
  if (kColumnTiles > 1) _tile_zero(1);
  if (kTexelTiles > 1) _tile_zero(2);
  if (kTexelTiles > 1 && kColumnTiles > 1) _tile_zero(3);
  for (int r = 0; r < row_count; ++r) {
    const uint16_t* a = static_cast<const uint16_t*>(rows[r]) + static_cast<int64_t>(texel) * stride;
    for (int k = 0; k < depth; k += kInner, weights += block) {
      _tile_loadd(4, a + k, step);
      _tile_loadd(6, weights, 64);
      _tile_dpbf16ps(0, 4, 6);
      if (kTexelTiles > 1) {
        _tile_loadd(5, a + k + static_cast<int64_t>(kSide) * stride, step);
        _tile_dpbf16ps(2, 5, 6);
      }
      if (kColumnTiles > 1) {
        _tile_loadd(7, weights + kTileElements, 64);
        _tile_dpbf16ps(1, 4, 7);
        if (kTexelTiles > 1) _tile_dpbf16ps(3, 5, 7);
      }
    }
  }
  const int64_t pitch = static_cast<int64_t>(width) * 4;
  float* to = out + static_cast<int64_t>(texel) * width + column;
  float* next = to + static_cast<int64_t>(kSide) * width;
  _tile_stored(0, to, pitch);
  if (kColumnTiles > 1) _tile_stored(1, to + kSide, pitch);
  if (kTexelTiles > 1) _tile_stored(2, next, pitch);
  if (kTexelTiles > 1 && kColumnTiles > 1) _tile_stored(3, next + kSide, pitch);
}

void Multiply(const void* const* rows, int row_count, int depth, int stride, const void* packed_weights, int width,
              int count, float* out) {
  ConfigureTiles();
  const uint16_t* packed = static_cast<const uint16_t*>(packed_weights);
  for (int texel = 0; texel < count;) {
    const bool two = texel + kSide < count;
    int column = 0;
    for (; column + 2 * kSide <= width; column += 2 * kSide) {
      if (two) {
        MultiplyTiles<2, 2>(rows, row_count, depth, stride, packed, width, texel, column, out);
      } else {
        MultiplyTiles<1, 2>(rows, row_count, depth, stride, packed, width, texel, column, out);
      }
    }
    if (column < width) {
      if (two) {
        MultiplyTiles<2, 1>(rows, row_count, depth, stride, packed, width, texel, column, out);
      } else {
        MultiplyTiles<1, 1>(rows, row_count, depth, stride, packed, width, texel, column, out);
      }
    }
    texel += two ? 2 * kSide : kSide;
  }
  _tile_release();
}

// 16 x 16 of 32 bits.
inline void Transpose(__m512i r[16]) {
  __m512i t[16];
  for (int i = 0; i < 16; i += 2) {
    t[i] = _mm512_unpacklo_epi32(r[i], r[i + 1]);
    t[i + 1] = _mm512_unpackhi_epi32(r[i], r[i + 1]);
  }
  for (int i = 0; i < 16; i += 4) {
    r[i] = _mm512_unpacklo_epi64(t[i], t[i + 2]);
    r[i + 1] = _mm512_unpackhi_epi64(t[i], t[i + 2]);
    r[i + 2] = _mm512_unpacklo_epi64(t[i + 1], t[i + 3]);
    r[i + 3] = _mm512_unpackhi_epi64(t[i + 1], t[i + 3]);
  }
  // Now the q-th quarter of r[4 i + j] holds column 4 q + j of rows 4 i ... 4 i + 3.
  for (int j = 0; j < 4; ++j) {
    const __m512i even_a = _mm512_shuffle_i32x4(r[j], r[4 + j], 0x88),
                  even_b = _mm512_shuffle_i32x4(r[8 + j], r[12 + j], 0x88),
                  odd_a = _mm512_shuffle_i32x4(r[j], r[4 + j], 0xdd),
                  odd_b = _mm512_shuffle_i32x4(r[8 + j], r[12 + j], 0xdd);
    t[j] = _mm512_shuffle_i32x4(even_a, even_b, 0x88);
    t[8 + j] = _mm512_shuffle_i32x4(even_a, even_b, 0xdd);
    t[4 + j] = _mm512_shuffle_i32x4(odd_a, odd_b, 0x88);
    t[12 + j] = _mm512_shuffle_i32x4(odd_a, odd_b, 0xdd);
  }
  for (int i = 0; i < 16; ++i) r[i] = t[i];
}

constexpr int Padded(int count) { return (count + kInner - 1) / kInner * kInner; }

// values [count][width] -> to [width][Padded(count)]
inline void TransposeValues(const uint16_t* values, int width, int count, uint16_t* to) {
  alignas(64) uint16_t order[32];
  for (int n = 0; n < 16; ++n)
    order[2 * n] = static_cast<uint16_t>(n), order[2 * n + 1] = static_cast<uint16_t>(16 + n);
  const __m512i pair_up = _mm512_load_si512(order);
  const int padded = Padded(count);
  for (int i = 0; i < padded; i += kInner) {
    for (int n = 0; n < width; n += kSide) {
      __m512i rows[16];
      for (int p = 0; p < 16; ++p) {
        const uint16_t* from = values + static_cast<int64_t>(i + 2 * p) * width + n;
        const __m256i first = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
        const __m256i second = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from + width));
        rows[p] = _mm512_permutexvar_epi16(pair_up, _mm512_inserti64x4(_mm512_castsi256_si512(first), second, 1));
      }
      Transpose(rows);
      for (int k = 0; k < 16; ++k) _mm512_storeu_si512(to + static_cast<int64_t>(n + k) * padded + i, rows[k]);
    }
  }
}

// row [i stride + k] -> to [Padded(count) / 2][depth][2]
inline void PairTexels(const uint16_t* row, int depth, int stride, int count, uint16_t* to) {
  alignas(64) uint16_t order[2][32];
  for (int k = 0; k < 32; ++k) {
    order[0][k] = static_cast<uint16_t>(k / 2 + k % 2 * 32);
    order[1][k] = static_cast<uint16_t>(16 + k / 2 + k % 2 * 32);
  }
  const __m512i low = _mm512_load_si512(order[0]), high = _mm512_load_si512(order[1]);
  for (int i = 0; i < Padded(count); i += 2, row += 2 * stride) {
    for (int k = 0; k < depth; k += 32, to += 64) {
      const __m512i a = _mm512_loadu_si512(row + k), b = _mm512_loadu_si512(row + stride + k);
      _mm512_store_si512(to, _mm512_permutex2var_epi16(a, low, b));
      _mm512_store_si512(to + 32, _mm512_permutex2var_epi16(a, high, b));
    }
  }
}

// Columns [n, n + 16) by k in [0, 16 kTiles) of the sums.
template <int kTiles>
inline void CorrelateTiles(const uint16_t* values, int padded, const uint16_t* pairs, int depth, float* sums) {
  const int64_t pitch = static_cast<int64_t>(depth) * 4, step = static_cast<int64_t>(padded) * 2;
  _tile_loadd(0, sums, pitch);
  _tile_loadd(1, sums + kSide, pitch);
  if (kTiles > 2) {
    _tile_loadd(2, sums + 2 * kSide, pitch);
    _tile_loadd(3, sums + 3 * kSide, pitch);
  }
  for (int i = 0; i < padded; i += kInner, pairs += static_cast<int64_t>(kInner) * depth) {
    _tile_loadd(4, values + i, step);
    _tile_loadd(5, pairs, pitch);
    _tile_dpbf16ps(0, 4, 5);
    _tile_loadd(6, pairs + kInner, pitch);
    _tile_dpbf16ps(1, 4, 6);
    if (kTiles > 2) {
      _tile_loadd(5, pairs + 2 * kInner, pitch);
      _tile_dpbf16ps(2, 4, 5);
      _tile_loadd(6, pairs + 3 * kInner, pitch);
      _tile_dpbf16ps(3, 4, 6);
    }
  }
  _tile_stored(0, sums, pitch);
  _tile_stored(1, sums + kSide, pitch);
  if (kTiles > 2) {
    _tile_stored(2, sums + 2 * kSide, pitch);
    _tile_stored(3, sums + 3 * kSide, pitch);
  }
}

int64_t ScratchBytes(int depth, int width, int count) {
  return static_cast<int64_t>(Padded(count)) * (depth + width) * 2 + 128;
}

void Correlate(const void* const* rows, int row_count, int depth, int stride, const void* values, int width, int count,
               float* sums, void* scratch) {
  ConfigureTiles();
  const int padded = Padded(count);
  uint16_t* const pairs = static_cast<uint16_t*>(scratch);
  uint16_t* const transposed = pairs + static_cast<int64_t>(padded) * depth;
  TransposeValues(static_cast<const uint16_t*>(values), width, count, transposed);
  for (int r = 0; r < row_count; ++r) {
    PairTexels(static_cast<const uint16_t*>(rows[r]), depth, stride, count, pairs);
    for (int n = 0; n < width; n += kSide, sums += static_cast<int64_t>(kSide) * depth) {
      const uint16_t* columns = transposed + static_cast<int64_t>(n) * padded;
      int k = 0;
      for (; k + 4 * kSide <= depth; k += 4 * kSide) CorrelateTiles<4>(columns, padded, pairs + 2 * k, depth, sums + k);
      if (k < depth) CorrelateTiles<2>(columns, padded, pairs + 2 * k, depth, sums + k);
    }
  }
  _tile_release();
}

}  // namespace

extern const RowKernels kRowKernels_amx;
const RowKernels kRowKernels_amx = {
    "amx", 2, 8, 16, true, 32, PackWeights, Multiply, Correlate, ScratchBytes, Load, LoadGradient, Split, Store, Copy};

}  // namespace likeness
