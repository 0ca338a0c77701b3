// The sRGB transfer function (IEC 61966-2-1), values in [0, 1].

#pragma once

#include <cmath>

namespace likeness {

inline float LinearFromSrgb(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

inline float SrgbFromLinear(float linear) {
  return linear <= 0.0031308f ? linear * 12.92f : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

// `share` of b over a, 0 to 255, mixed as light.
inline float MixSrgb(float a, float b, float share) {
  const float light_a = LinearFromSrgb(a / 255), light_b = LinearFromSrgb(b / 255);
  return 255 * SrgbFromLinear(light_a + share * (light_b - light_a));
}

}  // namespace likeness
