// A model's own texture coordinates as the atlas of its tracked surface, where they can be.

#pragma once

#include <optional>
#include <vector>

#include "likeness/simulate/glb/closed_surface.h"

namespace likeness {

struct OwnCoordinates {
  std::vector<Eigen::Vector2f> uvs;
  std::vector<Eigen::Vector3i> triangle_uvs;  // one a triangle of the surface, patches included
  float fill = 0;                             // part of the texture that they cover
};

// None when coordinates are absent, leave [0, 1], come from several textures, or overlap, or when lid patches would get
// less than half of the texels that the skin has for its size. Patches lie between the coordinates of their borders.
std::optional<OwnCoordinates> OwnAtlas(const ClosedSurface& surface, const Vertices& rest, const HeadModel& model);

}  // namespace likeness
