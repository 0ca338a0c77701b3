// What the AVX2 kernels share.

#pragma once

#include "likeness/decode/vector_impl.h"

namespace likeness {
namespace {

inline Vector LoadHalf(const Half* from) {
  return (Vector)_mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
}

inline __m256i Rounded(const float* values) {
  const __m256 v = _mm256_max_ps(_mm256_loadu_ps(values), _mm256_setzero_ps());
  return _mm256_cvttps_epi32(_mm256_add_ps(_mm256_min_ps(v, _mm256_set1_ps(255)), _mm256_set1_ps(0.5f)));
}

void Convert(const float* values, int count, PixelFormat format, void* pixels) {
  const int end = 4 * count;
  if (format == PixelFormat::kRgba16F) {
    ConvertToHalf(values, end, static_cast<Half*>(pixels));
    return;
  }
  uint8_t* const to = static_cast<uint8_t*>(pixels);
  const __m256i order = _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7);
  int i = 0;
  for (; i + 32 <= end; i += 32) {
    const __m256i low = _mm256_packs_epi32(Rounded(values + i), Rounded(values + i + 8));
    const __m256i high = _mm256_packs_epi32(Rounded(values + i + 16), Rounded(values + i + 24));
    const __m256i bytes = _mm256_permutevar8x32_epi32(_mm256_packus_epi16(low, high), order);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + i), bytes);
  }
  for (; i < end; ++i) {
    const float v = !(values[i] > 0) ? 0 : values[i] > 255 ? 255 : values[i];
    to[i] = static_cast<uint8_t>(v + 0.5f);
  }
}

// Every processor with AVX2 has F16C.
bool HasAvx2() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }

}  // namespace
}  // namespace likeness
