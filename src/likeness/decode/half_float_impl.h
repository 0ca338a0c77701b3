// Half precision without special instructions. In an unnamed namespace: kernels share no inline functions (kernel.h).

#pragma once

#include <stdint.h>

namespace likeness {
namespace {

// Rounds to nearest, ties to even. What is too large becomes the largest finite value.
inline uint16_t HalfFloat(float value) {
  constexpr float kLargest = 65504;
  const float clamped = value < -kLargest ? -kLargest : value > kLargest ? kLargest : value;
  const uint32_t bits = __builtin_bit_cast(uint32_t, clamped);
  const uint32_t sign = bits >> 16 & 0x8000, magnitude = bits & 0x7fffffff;
  if (magnitude < 0x38800000) {  // below the smallest normal one: multiples of 2^-24
    const float scaled = __builtin_bit_cast(float, magnitude) * 16777216.0f;
    return static_cast<uint16_t>(sign | static_cast<uint32_t>(__builtin_rintf(scaled)));
  }
  const uint32_t rounded = magnitude + 0xfff + (magnitude >> 13 & 1);
  return static_cast<uint16_t>(sign | ((rounded - 0x38000000) >> 13));
}

}  // namespace
}  // namespace likeness
