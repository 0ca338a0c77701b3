// All maps of a material side by side, so that one lookup brings what a surface point needs: the renderer's texture
// unit.

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "likeness/simulate/head.h"

namespace likeness {

// What the maps, or the material's constants, say about a surface point.
struct SurfaceSample {
  Eigen::Vector3f albedo;
  float coverage;
  Eigen::Vector3f normal;  // tangent space, about unit length; (0, 0, 1) without a normal map
  float roughness;
  float specular;
};

// Maps are held in 16 bits a value: a copy that lies together in memory. Maps of one size share their texels; of
// others there is one sheet for each size.
class MaterialMaps {
 public:
  // `linear`: albedo is decoded to linear light; otherwise its values come as they are, over 255.
  MaterialMaps(const Material& material, bool linear);

  // Bilinear; edges repeat. (0, 0) is the lower left corner of the maps.
  SurfaceSample Sample(const Eigen::Vector2f& uv) const;
  // Coverage alone, the same number.
  float Coverage(const Eigen::Vector2f& uv) const;
  // Brings the texels of a later Sample() nearer.
  void Prefetch(const Eigen::Vector2f& uv) const;
  bool has_normals() const { return has_normals_; }

 private:
  enum Lane { kAlbedo = 0, kCoverage = 3, kNormal = 4, kRoughness = 7, kSpecular = 8, kLanes = 12 };  // 9 are used
  using Texel = std::array<uint16_t, kLanes>;
  struct Sheet {
    int width, height;
    std::vector<Texel> texels;
  };

  Sheet* SheetOf(int width, int height);

  // A value is the sum over sheets times scale_, plus offset_.
  std::vector<Sheet> sheets_;
  std::array<float, kLanes> scale_ = {};
  std::array<float, kLanes> offset_ = {};
  bool has_normals_ = false;
};

}  // namespace likeness
