#include "likeness/simulate/lit_head.h"

#include <algorithm>
#include <array>

#include "likeness/base/parallel.h"

namespace likeness {
namespace {

// Shadow rays start this far off the surface, or they would hit it.
constexpr float kOffsetMm = 0.15f;

bool CastsShadow(const Material& material) {
  return material.casts_shadow && !material.transparent && material.albedo.channels() != 4;
}

// Returns the openness.
float FindVisibleLights(const RayScene& casters, const LightTable& lights, const Eigen::Vector3f& position,
                        const Eigen::Vector3f& normal, const Material& material, uint8_t* visibility) {
  constexpr int kGroup = LightTable::kGroup;
  const float wrap = *std::max_element(material.scatter.begin(), material.scatter.end());
  // Normal maps lean the surface towards lights that its vertex does not face.
  const float lowest = -0.2f - wrap;
  float arriving = 0, possible = 0;
  for (int begin = 0; begin < lights.size(); begin += kGroup) {
    std::array<Ray, kGroup> rays;
    std::array<int, kGroup> index;
    size_t count = 0;
    for (int i = begin; i < begin + kGroup; ++i) {
      visibility[i] = 0;
      if (lights.Irradiance(i) == 0) continue;
      Eigen::Vector3f direction = lights.Direction(i);
      const float facing = normal.dot(direction);
      if (facing < lowest) continue;
      if (facing < 0.02f) direction += (0.02f - facing) * normal;
      rays[count] = {position + kOffsetMm * normal, direction};
      index[count++] = i;
    }
    if (count == 0) continue;
    const uint32_t occluded = casters.Occluded16(std::span(rays.data(), count));
    for (size_t i = 0; i < count; ++i) {
      const bool seen = (occluded >> i & 1) == 0;
      visibility[index[i]] = seen ? 255 : 0;
      const float facing = normal.dot(lights.Direction(index[i]));
      const float light = lights.Irradiance(index[i]) * std::max(facing, 0.0f);
      possible += light;
      if (seen) arriving += light;
    }
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
    std::vector<uint8_t> visibility(static_cast<size_t>(vertices) * lights->size());
    std::vector<float> openness(static_cast<size_t>(vertices));
    constexpr int64_t kChunk = 256;
    ParallelFor((vertices + kChunk - 1) / kChunk, [&](int64_t chunk) {
      for (int64_t v = chunk * kChunk; v < std::min(vertices, (chunk + 1) * kChunk); ++v) {
        openness[v] = FindVisibleLights(casters, *lights, lit.positions[s].row(v), lit.normals[s].row(v),
                                        surfaces[s].material, visibility.data() + v * lights->size());
      }
    });
    lit.visibility.push_back(std::move(visibility));
    lit.openness.push_back(std::move(openness));
  }
  return lit;
}

}  // namespace likeness
