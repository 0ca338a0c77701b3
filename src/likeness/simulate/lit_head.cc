#include "likeness/simulate/lit_head.h"

#include <algorithm>
#include <atomic>

#include "likeness/base/parallel.h"

namespace likeness {
namespace {

// Shadow rays start this far off the surface, or they would hit it.
constexpr float kOffsetMm = 0.15f;

bool CastsShadow(const Material& material) {
  return material.casts_shadow && !material.transparent && material.albedo.channels() != 4;
}

// Returns the openness. Rays of one vertex run apart at once, so single ones are quicker than packets.
float FindVisibleLights(const RayScene& casters, const LightTable& lights, const Eigen::Vector3f& position,
                        const Eigen::Vector3f& normal, const Material& material, uint16_t* visible, int64_t* rays) {
  // Scattering carries light around the horizon, and normal maps lean the surface towards lights below it.
  const float lowest = -0.2f - *std::max_element(material.scatter.begin(), material.scatter.end());
  std::fill_n(visible, lights.groups(), uint16_t{0});
  float arriving = 0, possible = 0;
  for (int i = 0; i < lights.size(); ++i) {
    if (lights.Irradiance(i) == 0) continue;
    Eigen::Vector3f direction = lights.Direction(i);
    const float facing = normal.dot(direction);
    if (facing < lowest) continue;
    if (facing < 0.02f) direction += (0.02f - facing) * normal;
    ++*rays;
    const bool seen = !casters.Occluded({position + kOffsetMm * normal, direction});
    const float light = lights.Irradiance(i) * std::max(facing, 0.0f);
    possible += light;
    if (!seen) continue;
    visible[i / LightTable::kGroup] |= static_cast<uint16_t>(1u << i % LightTable::kGroup);
    arriving += light;
  }
  return possible > 0 ? arriving / possible : 1;
}

}  // namespace

LitHead LightHead(const Head& head, const PosedHead& posed, const RigidTransform& world_from_head,
                  const LightTable* lights) {
  const std::vector<Surface>& surfaces = head.surfaces();
  LIKENESS_CHECK(posed.surfaces.size() == surfaces.size() && posed.normals.size() == surfaces.size());
  LitHead lit;
  lit.head = &head;
  const Eigen::Matrix3f rotation = world_from_head.rotation.cast<float>();
  const Eigen::RowVector3f translation = world_from_head.translation.cast<float>().transpose();
  RayScene casters;
  for (size_t s = 0; s < surfaces.size(); ++s) {
    lit.positions.emplace_back((posed.surfaces[s] * rotation.transpose()).rowwise() + translation);
    lit.normals.emplace_back(posed.normals[s] * rotation.transpose());
    lit.scene.Add(lit.positions[s], surfaces[s].topology.triangles);
    if (lights != nullptr && CastsShadow(surfaces[s].material)) {
      casters.Add(lit.positions[s], surfaces[s].topology.triangles);
    }
  }
  lit.scene.Build();
  if (lights == nullptr) return lit;
  casters.Build();
  for (size_t s = 0; s < surfaces.size(); ++s) {
    const int64_t vertices = lit.positions[s].rows();
    std::vector<uint16_t> visible(static_cast<size_t>(vertices) * lights->groups());
    std::vector<float> openness(static_cast<size_t>(vertices));
    std::atomic<int64_t> rays = 0;
    constexpr int64_t kChunk = 256;
    ParallelFor((vertices + kChunk - 1) / kChunk, [&](int64_t chunk) {
      int64_t traced = 0;
      for (int64_t v = chunk * kChunk; v < std::min(vertices, (chunk + 1) * kChunk); ++v) {
        openness[v] = FindVisibleLights(casters, *lights, lit.positions[s].row(v), lit.normals[s].row(v),
                                        surfaces[s].material, visible.data() + v * lights->groups(), &traced);
      }
      rays += traced;
    });
    lit.shadow_rays += rays;
    lit.visible.push_back(std::move(visible));
    lit.openness.push_back(std::move(openness));
  }
  return lit;
}

}  // namespace likeness
