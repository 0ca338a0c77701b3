// What the AVX-512 kernels share.

#pragma once

#include "likeness/decode/vector_impl.h"

namespace likeness {
namespace {

inline Vector LoadHalf(const Half* from) {
  return (Vector)_mm512_cvtph_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)));
}

void Convert(const float* values, int count, PixelFormat format, void* pixels) {
  const int end = 4 * count;
  if (format == PixelFormat::kRgba16F) {
    ConvertToHalf(values, end, static_cast<Half*>(pixels));
    return;
  }
  uint8_t* const to = static_cast<uint8_t*>(pixels);
  for (int i = 0; i < end; i += 16) {
    const auto mask = static_cast<__mmask16>(end - i >= 16 ? 0xffff : (1 << (end - i)) - 1);
    const __m512 v =
        _mm512_min_ps(_mm512_max_ps(_mm512_maskz_loadu_ps(mask, values + i), _mm512_setzero_ps()), _mm512_set1_ps(255));
    const __m512i rounded = _mm512_cvttps_epi32(_mm512_add_ps(v, _mm512_set1_ps(0.5f)));
    _mm512_mask_cvtepi32_storeu_epi8(to + i, mask, rounded);
  }
}

bool HasAvx512() {
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
}

}  // namespace
}  // namespace likeness
