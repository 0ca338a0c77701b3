#include "likeness/simulate/light_rig.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "likeness/base/error.h"

namespace likeness {

LightRig EvenLights(int count, float white) {
  if (count < 1 || count > 4096) throw Error("a rig has 1 to 4096 lights, not {}", count);
  constexpr double kPi = std::numbers::pi;
  constexpr double kGoldenAngle = 2.399963229728653;  // pi (3 - sqrt(5))
  LightRig rig;
  double facing = 0;
  for (int i = 0; i < count; ++i) {
    // One light alone stands in front and above.
    const double y = count == 1 ? 0.4 : 1 - (2 * i + 1.0) / count;
    const double radius = std::sqrt(1 - y * y);
    const double azimuth = count == 1 ? 0 : kGoldenAngle * i;
    const Eigen::Vector3d direction(radius * std::sin(azimuth), y, radius * std::cos(azimuth));
    // A broad key light: several lights wide, so that it shapes the face and shows as a highlight.
    const double key = std::max(0.0, direction.dot(Eigen::Vector3d(0.3, 0.55, 0.8).normalized()));
    const double strength = 0.42 + 0.15 * direction.y() + 4.5 * std::pow(key, 20);
    rig.lights.push_back({direction.cast<float>(), static_cast<float>(strength)});
    facing += strength * std::max(0.0, direction.z());
  }
  const auto scale = static_cast<float>(white * kPi / std::max(facing, 1e-6));
  for (Light& light : rig.lights) light.irradiance *= scale;
  return rig;
}

}  // namespace likeness
