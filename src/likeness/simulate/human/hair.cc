#include "likeness/simulate/human/hair.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "likeness/base/parallel.h"
#include "likeness/base/random.h"
#include "likeness/simulate/human/noise.h"
#include "likeness/simulate/human/pigment.h"
#include "likeness/simulate/human/skin_regions.h"

namespace likeness {
namespace {

using Eigen::Vector3f;

const Vector3f kSkullCentre(0, 22, -75);
const Vector3f kWhorl(8, 112, -120);  // where hair parts on the crown
constexpr float kWidestAngle = 2.5f;  // radians from the top of the head to the edge of the texture

float LengthMm(const HumanRecipe& recipe) { return 0.8f + 3.2f * static_cast<float>(recipe.hair_length); }

// The scalp seen from its top: equal angles from the top are equally far from the middle.
Eigen::Vector2f ScalpUv(const Vector3f& average) {
  const Vector3f d = (average - kSkullCentre).normalized();
  const float angle = std::acos(std::clamp(d.y(), -1.0f, 1.0f));
  const Eigen::Vector2f around = Eigen::Vector2f(d.x(), -d.z()).stableNormalized();
  return Eigen::Vector2f(0.5f, 0.5f) + std::min(angle / kWidestAngle, 1.0f) * 0.499f * around;
}

}  // namespace

HairShells::HairShells(const std::vector<int>& fine_vertices, const std::vector<Eigen::Vector3i>& triangles,
                       const Vertices& points, const Vertices& average, const HumanRecipe& recipe) {
  const auto hairline = static_cast<float>(recipe.hairline);
  const auto weight = [&](int v) { return ScalpWeight(average.row(v).transpose(), hairline); };
  std::map<int, int> index;
  std::vector<int> rows;
  for (const Eigen::Vector3i& t : triangles) {
    if (std::max({weight(t[0]), weight(t[1]), weight(t[2])}) <= 0) continue;
    Eigen::Vector3i own;
    for (int k = 0; k < 3; ++k) {
      const auto [it, added] = index.try_emplace(t[k], static_cast<int>(rows.size()));
      if (added) rows.push_back(t[k]);
      own[k] = it->second;
    }
    topology_.triangles.push_back(own);
  }
  topology_.triangle_uvs = topology_.triangles;
  topology_.vertex_count = static_cast<int>(rows.size());
  const auto seed = static_cast<uint32_t>(Hash({recipe.seed, 70}));
  for (const int row : rows) {
    const Vector3f p = average.row(row);
    fine_vertices_.push_back(fine_vertices[row]);
    topology_.uvs.push_back(ScalpUv(p));
    const float uneven = 1 + 0.25f * FractalNoise(p / 14, 2, seed);
    // Short at the hairline, longer on top than at the sides.
    height_.push_back(LengthMm(recipe) * uneven * (0.25f + 0.75f * SmoothStep(0.2f, 1, weight(row))) *
                      (0.65f + 0.35f * SmoothStep(20, 80, p.y())));
  }

  const int size = recipe.texture_size;
  const TexelMap map = MapTexels(topology_, size);
  const Vector3f colour =
      HairColour(static_cast<float>(recipe.hair_melanin), static_cast<float>(recipe.hair_redness), 0);
  const Vector3f grey = HairColour(static_cast<float>(recipe.hair_melanin), static_cast<float>(recipe.hair_redness), 1);
  for (Material& material : materials_) {
    // Hair-coloured even where there is none: what lies between two texels must not turn black.
    material.albedo = ImageU8(size, size, 4);
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        for (int c = 0; c < 3; ++c) material.albedo.at(x, y)[c] = EncodeSrgb(colour[c]);
      }
    }
    material.roughness = 0.6f;
    material.specular_f0 = 0.025f;  // less than hair's own: a shell is a card, and shines all at once
    material.scatter = {0.3f, 0.25f, 0.2f};
    material.casts_shadow = false;
  }
  ParallelFor(size, [&](int64_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < size; ++x) {
      const TexelMap::Texel& texel = map.at(x, y);
      if (texel.triangle < 0) continue;
      const float w[3] = {1 - texel.b1 - texel.b2, texel.b1, texel.b2};
      Vector3f point = Vector3f::Zero(), where = Vector3f::Zero();
      for (int k = 0; k < 3; ++k) {
        const int v = rows[topology_.triangles[texel.triangle][k]];
        point += w[k] * points.row(v).transpose();
        where += w[k] * average.row(v).transpose();
      }
      const float ragged = 0.3f * FractalNoise(point / 3, 2, seed + 1);
      const float cover = std::clamp(1.35f * ScalpWeight(where, hairline) + ragged - 0.2f, 0.0f, 1.0f) *
                          static_cast<float>(recipe.scalp_hair);
      if (cover <= 0) continue;
      // Hairs lie away from the whorl, and forward over the forehead.
      const Vector3f out = (where - kSkullCentre).normalized();
      Vector3f flow = (where - kWhorl).normalized() + Vector3f(0, -0.35f, 0.25f);
      flow += 0.35f * Vector3f(FractalNoise(point / 11, 2, seed + 2), FractalNoise(point / 11, 2, seed + 3), 0);
      flow = (flow - out * out.dot(flow)).stableNormalized();
      for (int shell = 0; shell < kHairShells; ++shell) {
        const float up = (static_cast<float>(shell) + 1) / kHairShells;
        // A hair is found where it left the skin. Tufts of a few hairs are what a texel can show.
        const Vector3f root = point - flow * (0.8f * LengthMm(recipe) * up * up);
        const NearestSpot hair = FindNearestSpot(root / 0.8f, seed + 4);
        const float length = 0.55f + 0.45f * UnitFromBits(hair.id);
        const float radius = 0.72f * (1 - 0.6f * up);
        const float alpha = SmoothStep(radius, 0.55f * radius, hair.distance) * (up <= length ? 1.0f : 0.0f) *
                            SmoothStep(1 - cover, 1.15f - cover, 0.15f + UnitFromBits(hair.id * 7));
        uint8_t* out_texel = materials_[shell].albedo.at(x, y);
        const bool is_grey = UnitFromBits(hair.id * 13) < static_cast<float>(recipe.grey);
        // Light fades between the hairs towards the skin.
        const float tone = (0.45f + 0.75f * up) * (0.75f + 0.5f * UnitFromBits(hair.id * 3));
        for (int c = 0; c < 3; ++c) out_texel[c] = EncodeSrgb(tone * (is_grey ? grey : colour)[c]);
        out_texel[3] = static_cast<uint8_t>(std::lround(255 * std::clamp(alpha, 0.0f, 1.0f)));
      }
    }
  });
}

Vertices HairShells::Positions(int shell, const Vertices& fine, const Vertices& fine_normals) const {
  Vertices positions(topology_.vertex_count, 3);
  const float up = (static_cast<float>(shell) + 1) / kHairShells;
  for (int i = 0; i < topology_.vertex_count; ++i) {
    positions.row(i) = fine.row(fine_vertices_[i]) + up * height_[i] * fine_normals.row(fine_vertices_[i]);
  }
  return positions;
}

std::vector<float> HairShells::ApparentHeight(int fine_count) const {
  constexpr float kClosed = 0.8f;  // of the outermost shell's height; hairs are 0.55 to 1 of it long
  std::vector<float> height(fine_count, 0.0f);
  for (size_t i = 0; i < fine_vertices_.size(); ++i) height[fine_vertices_[i]] = kClosed * height_[i];
  return height;
}

}  // namespace likeness
