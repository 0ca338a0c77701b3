// What the x86 kernels share: half-precision numbers by F16C, and the thread's floating-point mode. Included by
// kernels.

#pragma once

#include <immintrin.h>
#include <stdint.h>

#include "likeness/decode/kernel.h"

namespace likeness {
namespace {

using Half = uint16_t;

inline float FromHalf(Half value) { return _cvtsh_ss(value); }

// False where a value is beyond +-`most`.
inline bool PackHalves(const float* values, int64_t count, float most, void* packed) {
  Half* const to = static_cast<Half*>(packed);
  bool fits = true;
  for (int64_t i = 0; i < count; ++i) {
    fits = fits && values[i] >= -most && values[i] <= most;
    to[i] = _cvtss_sh(values[i], _MM_FROUND_TO_NEAREST_INT);
  }
  return fits;
}

// Features are a few units large, colours up to 255: of what is larger, half precision would lose too much.
inline bool PackHalfBias(const PackedConvolution&, const float* values, int count, void* packed) {
  return PackHalves(values, count, 64, packed);
}
inline bool PackColours(const float* values, int count, void* packed) {
  return PackHalves(values, count, 1024, packed);
}
inline bool PackDense(const float* values, int64_t count, void* packed) {
  return PackHalves(values, count, 65504, packed);
}

// Colours from 0 to 1; what is too large becomes the largest finite value.
inline void ConvertToHalf(const float* values, int count, Half* to) {
  const __m128 scale = _mm_set1_ps(1 / 255.0f), largest = _mm_set1_ps(65504), least = _mm_set1_ps(-65504);
  for (int i = 0; i < count; i += 4) {
    const __m128 v = _mm_max_ps(_mm_min_ps(_mm_mul_ps(_mm_loadu_ps(values + i), scale), largest), least);
    _mm_storel_epi64(reinterpret_cast<__m128i*>(to + i), _mm_cvtps_ph(v, _MM_FROUND_TO_NEAREST_INT));
  }
}

inline void AddEight(const float* sums, const Half* bias, float* to) {
  const __m256 b = _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(bias)));
  _mm256_storeu_ps(to, _mm256_add_ps(_mm256_loadu_ps(sums), b));
}

// Numbers too small to be normal count as zero: they would cost a hundred times the time.
unsigned Enter() {
  constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x40;
  const unsigned mode = _mm_getcsr();
  _mm_setcsr(mode | kFlushToZero | kDenormalsAreZero);
  return mode;
}
void Leave(unsigned mode) { _mm_setcsr(mode); }

}  // namespace
}  // namespace likeness
