#include "likeness/simulate/light_sum.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

// A group of lights is one vector of the compiler's; on x86 it makes one copy of the code for each vector width that
// machines have, and the machine's own is chosen at load time. Thread sanitizer cannot start with such copies.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__)
#define LIKENESS_VECTOR_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define LIKENESS_VECTOR_CLONES
#endif

namespace likeness {
namespace {

constexpr int kGroup = LightTable::kGroup;

// Splits at the median of the widest axis until a part fits into a group.
void SortIntoGroups(std::vector<Light>& lights, size_t begin, size_t end) {
  if (end - begin <= kGroup) return;
  Eigen::Vector3f low = lights[begin].direction, high = low;
  for (size_t i = begin; i < end; ++i) {
    low = low.cwiseMin(lights[i].direction);
    high = high.cwiseMax(lights[i].direction);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  // The left part takes whole groups.
  const size_t groups = (end - begin + kGroup - 1) / kGroup;
  const size_t middle = begin + groups / 2 * kGroup;
  std::stable_sort(lights.begin() + begin, lights.begin() + end,
                   [axis](const Light& a, const Light& b) { return a.direction[axis] < b.direction[axis]; });
  SortIntoGroups(lights, begin, middle);
  SortIntoGroups(lights, middle, end);
}

using Floats = float __attribute__((vector_size(sizeof(float) * kGroup)));
using Integers = int32_t __attribute__((vector_size(sizeof(int32_t) * kGroup)));

__attribute__((always_inline)) inline Floats Load(const float* from) {
  Floats values;
  std::memcpy(&values, from, sizeof(values));
  return values;
}

// `value` where the light's bit is set, else 0.
__attribute__((always_inline)) inline Floats Where(uint16_t lights, float value) {
  constexpr Integers kBits = {1 << 0, 1 << 1, 1 << 2,  1 << 3,  1 << 4,  1 << 5,  1 << 6,  1 << 7,
                              1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, 1 << 15};
  const Floats zero = {};
  return (kBits & static_cast<int32_t>(lights)) != 0 ? value + zero : zero;
}

// Through memory: so the compiler makes one instruction of it.
__attribute__((always_inline)) inline Floats SquareRoot(const Floats& values) {
  alignas(64) float lanes[kGroup];
  std::memcpy(lanes, &values, sizeof(lanes));
  for (float& lane : lanes) lane = std::sqrt(lane);
  return Load(lanes);
}

// The specular light of one group.
__attribute__((always_inline)) inline Floats Lobe(const SpecularLobe& lobe, const LightQuery& query, float nv, Floats x,
                                                  Floats y, Floats z, Floats strength) {
  const Floats zero = {};
  const float a = lobe.alpha, a2 = a * a, f0 = lobe.f0;
  const Floats nl_signed = query.normal.x() * x + query.normal.y() * y + query.normal.z() * z;
  const Floats nl = nl_signed > 0 ? nl_signed : zero;
  const Floats lv = query.view.x() * x + query.view.y() * y + query.view.z() * z;
  const Floats lv1 = lv > -0.9999f ? 1 + lv : 1e-4f + zero;
  // h = (l + v) / |l + v|, |l + v|^2 = 2 (1 + l.v); D is multiplied out with that square, so that the whole term takes
  // one division.
  const Floats lv2 = 2 * lv1, nh = nl + nv, nh2 = nh * nh < lv2 ? nh * nh : lv2;
  const Floats d = nh2 * (a2 - 1) + lv2;
  const Floats vh = SquareRoot(0.5f * lv1);
  const Floats m = vh < 1 ? 1 - vh : zero, m2 = m * m;
  const Floats fresnel = f0 + (1 - f0) * m2 * m2 * m;
  // V = 1 / (2 lerp(2 n.l n.v, n.l + n.v, alpha))
  const Floats smith = 2 * (2 * nl * nv * (1 - a) + nh * a);
  return strength * nl * fresnel * a2 * lv2 * lv2 / (d * d * smith);
}

__attribute__((always_inline)) inline float Sum(const Floats& values) {
  float sum = 0;
  for (int i = 0; i < kGroup; ++i) sum += values[i];
  return sum;
}

}  // namespace

struct LightColumns {
  const float *x, *y, *z, *irradiance;
  explicit LightColumns(const LightTable& t)
      : x(t.x_.data()), y(t.y_.data()), z(t.z_.data()), irradiance(t.irradiance_.data()) {}
};

LightTable::LightTable(const LightRig& rig) : angular_radius_(rig.angular_radius) {
  std::vector<Light> lights = rig.lights;
  SortIntoGroups(lights, 0, lights.size());
  while (lights.size() % kGroup != 0) lights.push_back({lights.back().direction, 0});
  for (const Light& light : lights) {
    x_.push_back(light.direction.x());
    y_.push_back(light.direction.y());
    z_.push_back(light.direction.z());
    irradiance_.push_back(light.irradiance);
  }
}

LIKENESS_VECTOR_CLONES
LightSum SumLights(const LightTable& lights, const LightQuery& query) {
  const LightColumns columns(lights);
  Floats diffuse[3] = {}, specular = {}, coat = {};
  const Floats zero = {};
  const float nv = std::max(query.normal.dot(query.view), 0.02f);
  for (int begin = 0; begin < lights.size(); begin += kGroup) {
    const int group = begin / kGroup;
    const uint16_t v0 = query.visible[0][group], v1 = query.visible[1][group], v2 = query.visible[2][group];
    if ((v0 | v1 | v2) == 0) continue;
    const Floats x = Load(columns.x + begin), y = Load(columns.y + begin), z = Load(columns.z + begin);
    const Floats strength = Load(columns.irradiance + begin) *
                            (Where(v0, query.weights[0]) + Where(v1, query.weights[1]) + Where(v2, query.weights[2]));
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector3f& n = query.diffuse_normal[c];
      const Floats nl = n.x() * x + n.y() * y + n.z() * z + query.wrap[c];
      diffuse[c] += strength * (nl > 0 ? nl : zero);
    }
    if (query.has_specular) specular += Lobe(query.specular, query, nv, x, y, z, strength);
    if (query.has_coat) coat += Lobe(query.coat, query, nv, x, y, z, strength);
  }

  constexpr float kInversePi = std::numbers::inv_pi_v<float>;
  LightSum sum;
  for (int c = 0; c < 3; ++c) {
    const float wrapped = 1 + query.wrap[c];
    sum.diffuse[c] = Sum(diffuse[c]) * kInversePi / (wrapped * wrapped);
  }
  sum.specular = Sum(specular) * kInversePi;
  sum.coat = Sum(coat) * kInversePi;
  return sum;
}

}  // namespace likeness
