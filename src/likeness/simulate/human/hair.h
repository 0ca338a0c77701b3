// Cropped hair on the scalp: a few transparent shells over the skin, through which every hair grows (Lengyel 2000).

#pragma once

#include <array>
#include <vector>

#include "likeness/geometry/mesh.h"
#include "likeness/simulate/head.h"
#include "likeness/simulate/human/recipe.h"

namespace likeness {

inline constexpr int kHairShells = 5;

class HairShells {
 public:
  HairShells() = default;
  //   fine_vertices  those of the skin's surface, as indices into positions and normals of later calls
  //   triangles      the skin's, indices into fine_vertices
  //   points         the person at rest, head space; one for each of fine_vertices
  //   average        likewise in the space of skin_regions.h
  HairShells(const std::vector<int>& fine_vertices, const std::vector<Eigen::Vector3i>& triangles,
             const Vertices& points, const Vertices& average, const HumanRecipe& recipe);

  // Shared by all shells; shell 0 is the innermost.
  const MeshTopology& topology() const { return topology_; }
  const Material& material(int shell) const { return materials_[shell]; }
  Vertices Positions(int shell, const Vertices& fine, const Vertices& fine_normals) const;

  // How far over the skin, mm, a tracker finds the scalp: where the hair closes. One for each vertex of the fine skin.
  std::vector<float> ApparentHeight(int fine_count) const;

 private:
  std::vector<int> fine_vertices_;
  std::vector<float> height_;  // of the outermost shell over the skin, mm
  MeshTopology topology_;
  std::array<Material, kHairShells> materials_;
};

}  // namespace likeness
