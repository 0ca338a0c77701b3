#include "likeness/simulate/light_sum.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

// The loops over one group of lights are left to the compiler's vectoriser; on x86 it makes one copy for each vector
// width and the machine's own is chosen at load time. Thread sanitizer cannot start with such copies.
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

bool AllZero(const uint8_t* values) {
  uint64_t words[kGroup / 8];
  std::memcpy(words, values, kGroup);
  return (words[0] | words[1]) == 0;
}

// Adds the specular light of one group.
__attribute__((always_inline)) inline void AddLobe(const SpecularLobe& lobe, const LightQuery& query, float nv,
                                                   const float* x, const float* y, const float* z,
                                                   const float* strength, float* sum) {
  const float nx = query.normal.x(), ny = query.normal.y(), nz = query.normal.z();
  const float vx = query.view.x(), vy = query.view.y(), vz = query.view.z();
  const float a = lobe.alpha, a2 = a * a, f0 = lobe.f0;
  for (int i = 0; i < kGroup; ++i) {
    const float nl_signed = nx * x[i] + ny * y[i] + nz * z[i];
    const float nl = nl_signed > 0 ? nl_signed : 0;
    const float lv = vx * x[i] + vy * y[i] + vz * z[i];
    const float lv1 = lv > -0.9999f ? 1 + lv : 1e-4f;
    // h = (l + v) / |l + v|, |l + v|^2 = 2 (1 + l.v)
    const float nh = (nl + nv) / std::sqrt(2 * lv1);
    const float vh = std::sqrt(0.5f * lv1);
    const float nh2 = nh < 1 ? nh * nh : 1;
    const float d = nh2 * (a2 - 1) + 1;
    const float m = vh < 1 ? 1 - vh : 0;
    const float m2 = m * m;
    const float fresnel = f0 + (1 - f0) * m2 * m2 * m;
    // V = 1 / (2 lerp(2 n.l n.v, n.l + n.v, alpha))
    const float smith = 2 * (2 * nl * nv * (1 - a) + (nl + nv) * a);
    sum[i] += strength[i] * nl * fresnel * a2 / (d * d * smith);
  }
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
  alignas(64) float diffuse[3][kGroup] = {};
  alignas(64) float specular[kGroup] = {};
  alignas(64) float coat[kGroup] = {};
  const float nv = std::max(query.normal.dot(query.view), 0.02f);

  for (int begin = 0; begin < lights.size(); begin += kGroup) {
    const uint8_t* v0 = query.visibility[0] + begin;
    const uint8_t* v1 = query.visibility[1] + begin;
    const uint8_t* v2 = query.visibility[2] + begin;
    if (AllZero(v0) && AllZero(v1) && AllZero(v2)) continue;
    const float* x = columns.x + begin;
    const float* y = columns.y + begin;
    const float* z = columns.z + begin;
    const float* irradiance = columns.irradiance + begin;
    const float w0 = query.weights[0] / 255, w1 = query.weights[1] / 255, w2 = query.weights[2] / 255;
    alignas(64) float strength[kGroup];
    for (int i = 0; i < kGroup; ++i) {
      strength[i] = irradiance[i] *
                    (w0 * static_cast<float>(v0[i]) + w1 * static_cast<float>(v1[i]) + w2 * static_cast<float>(v2[i]));
    }
    for (int c = 0; c < 3; ++c) {
      const float dx = query.diffuse_normal[c].x(), dy = query.diffuse_normal[c].y(), dz = query.diffuse_normal[c].z();
      const float wrap = query.wrap[c];
      for (int i = 0; i < kGroup; ++i) {
        const float nl = dx * x[i] + dy * y[i] + dz * z[i] + wrap;
        diffuse[c][i] += strength[i] * (nl > 0 ? nl : 0);
      }
    }
    if (query.has_specular) AddLobe(query.specular, query, nv, x, y, z, strength, specular);
    if (query.has_coat) AddLobe(query.coat, query, nv, x, y, z, strength, coat);
  }

  constexpr float kInversePi = std::numbers::inv_pi_v<float>;
  LightSum sum;
  for (int i = 0; i < kGroup; ++i) {
    for (int c = 0; c < 3; ++c) sum.diffuse[c] += diffuse[c][i];
    sum.specular += specular[i];
    sum.coat += coat[i];
  }
  for (int c = 0; c < 3; ++c) {
    const float wrapped = 1 + query.wrap[c];
    sum.diffuse[c] *= kInversePi / (wrapped * wrapped);
  }
  sum.specular *= kInversePi;
  sum.coat *= kInversePi;
  return sum;
}

}  // namespace likeness
