// Vectors of 16-bit fixed-point numbers for int16_kernel_impl.h. LIKENESS_NARROW_ROWS is the number of result rows
// whose sums fit the registers; LIKENESS_VNNI, that the processor adds products of pairs to sums in one instruction.

#pragma once

#include <immintrin.h>
#include <stdint.h>

namespace likeness {
namespace {

#ifdef LIKENESS_VNNI
// Not the intrinsic: GCC 12 copies every sum to another register and back.
template <class V>
__attribute__((always_inline)) inline V AddProducts(V sums, V pairs, V weights) {
  __asm__("vpdpwssd %2, %1, %0" : "+v"(sums) : "v"(pairs), "v"(weights));
  return sums;
}
#endif

// 256 bits.
struct Narrow {
  using Type = __m256i;
  static constexpr int kColumns = 16;
  static constexpr int kRows = LIKENESS_NARROW_ROWS;

  static Type Load(const int16_t* from) { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)); }
  static void Store(int16_t* to, Type v) { _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), v); }
  static Type Set16(int16_t value) { return _mm256_set1_epi16(value); }
  static Type Set32(int32_t value) { return _mm256_set1_epi32(value); }
  // Two neighbouring values everywhere.
  static Type Pair(const int16_t* from) {
    int32_t pair;
    __builtin_memcpy(&pair, from, sizeof(pair));
    return _mm256_set1_epi32(pair);
  }
  static Type Dot(Type sums, Type pairs, Type weights) {
#ifdef LIKENESS_VNNI
    return AddProducts(sums, pairs, weights);
#else
    return _mm256_add_epi32(sums, _mm256_madd_epi16(pairs, weights));
#endif
  }
  static Type Join(Type low, Type high, int shift) {
    return _mm256_packs_epi32(_mm256_srai_epi32(low, shift), _mm256_srai_epi32(high, shift));
  }
  static Type Add(Type a, Type b) { return _mm256_adds_epi16(a, b); }
  static Type Min(Type a, Type b) { return _mm256_min_epi16(a, b); }
  static Type Max(Type a, Type b) { return _mm256_max_epi16(a, b); }
  static Type Scale(Type a, Type b) { return _mm256_mulhrs_epi16(a, b); }  // a b / 2^15
  template <int kCount>
  static Type ShiftRight(Type v) {
    return _mm256_srai_epi16(v, kCount);
  }
  // The lower halves of two vectors, and the upper ones, as 16 bytes each.
  static void StoreBytes(uint8_t* lower, uint8_t* upper, Type first, Type second) {
    const Type bytes = _mm256_packus_epi16(first, second);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(lower), _mm256_castsi256_si128(bytes));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(upper), _mm256_extracti128_si256(bytes, 1));
  }
};

#ifdef LIKENESS_VNNI
// 512 bits.
struct Wide {
  using Type = __m512i;
  static constexpr int kColumns = 32;
  static constexpr int kRows = 12;

  static Type Load(const int16_t* from) { return _mm512_loadu_si512(from); }
  static void Store(int16_t* to, Type v) { _mm512_storeu_si512(to, v); }
  static Type Set16(int16_t value) { return _mm512_set1_epi16(value); }
  static Type Set32(int32_t value) { return _mm512_set1_epi32(value); }
  static Type Pair(const int16_t* from) {
    int32_t pair;
    __builtin_memcpy(&pair, from, sizeof(pair));
    return _mm512_set1_epi32(pair);
  }
  static Type Dot(Type sums, Type pairs, Type weights) { return AddProducts(sums, pairs, weights); }
  static Type Join(Type low, Type high, int shift) {
    return _mm512_packs_epi32(_mm512_srai_epi32(low, shift), _mm512_srai_epi32(high, shift));
  }
  static Type Add(Type a, Type b) { return _mm512_adds_epi16(a, b); }
  static Type Min(Type a, Type b) { return _mm512_min_epi16(a, b); }
  static Type Max(Type a, Type b) { return _mm512_max_epi16(a, b); }
  static Type Scale(Type a, Type b) { return _mm512_mulhrs_epi16(a, b); }
};
#else
using Wide = Narrow;
#endif

}  // namespace
}  // namespace likeness
