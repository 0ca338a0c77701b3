#include "likeness/simulate/human/pigment.h"

#include <algorithm>
#include <cmath>

#include "likeness/image/srgb.h"

namespace likeness {

Eigen::Vector3f SkinColour(float melanin, float haemoglobin) {
  const Eigen::Array3f dermis(0.89f, 0.77f, 0.63f);
  const Eigen::Array3f blood(0.12f, 0.72f, 0.74f);
  const Eigen::Array3f pigment(1.80f, 2.35f, 3.35f);
  // The visible steps between skin types are even in a power of the concentration.
  const float optical = std::pow(std::max(melanin, 0.0f), 1.4f);
  return dermis * (-haemoglobin * blood - optical * pigment).exp();
}

Eigen::Vector3f HairColour(float melanin, float redness, float grey) {
  const Eigen::Array3f eumelanin(1.7f, 2.3f, 3.2f), pheomelanin(0.2f, 1.3f, 2.6f);
  const Eigen::Array3f coloured =
      0.006f +
      0.62f * (-(0.25f + 2 * melanin * melanin) * eumelanin - 0.5f * redness * (1.1f - melanin) * pheomelanin).exp();
  return coloured + grey * (Eigen::Array3f(0.34f, 0.33f, 0.32f) - coloured);
}

uint8_t EncodeSrgb(float linear) {
  return static_cast<uint8_t>(std::lround(255 * SrgbFromLinear(std::clamp(linear, 0.0f, 1.0f))));
}

}  // namespace likeness
