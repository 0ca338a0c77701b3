#include "likeness/decode/frame_checks.h"

#include <algorithm>
#include <cmath>

#include "likeness/base/error.h"

namespace likeness {

namespace {

bool AllFinite(std::span<const float> values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

}  // namespace

void CheckCode(std::span<const float> code, const Architecture& architecture) {
  if (code.size() != static_cast<size_t>(architecture.latent)) {
    throw Error("a code has {} values; this avatar's have {}", code.size(), architecture.latent);
  }
  if (!AllFinite(code)) throw Error("a code holds a value that is not finite");
}

void CheckViewCount(size_t views) {
  if (views > kMostViews) throw Error("{} views; expected at most {}", views, kMostViews);
}

void CheckDirection(const float direction[3]) {
  const double x = direction[0], y = direction[1], z = direction[2];
  const double length = std::sqrt(x * x + y * y + z * z);
  if (!(std::abs(length - 1) < 1e-3)) throw Error("a view vector is {} long; expected a unit vector", length);
}

void CheckConditions(std::span<const float> values) {
  if (!AllFinite(values)) throw Error("a named condition is not finite");
}

void CheckDisplay(const DisplayTransform& display) {
  if (!AllFinite(display.gain) || !AllFinite(display.offset)) throw Error("a display transform is not finite");
}

}  // namespace likeness
