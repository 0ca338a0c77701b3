// What the AVX2 and AVX-512 kernels share.

#pragma once

#include <immintrin.h>

#include "likeness/render/raster_impl.h"

namespace likeness {
namespace {

inline void LoadPair(const uint8_t* from, TexelPair* pair) {
  *pair = _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(from))));
}

inline uint32_t Pack(const Texel* colour) {
  const __m128i whole = _mm_cvttps_epi32(*colour);
  return static_cast<uint32_t>(_mm_cvtsi128_si32(_mm_packus_epi16(_mm_packs_epi32(whole, whole), whole)));
}

}  // namespace
}  // namespace likeness
