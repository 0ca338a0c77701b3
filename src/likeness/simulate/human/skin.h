// Paints skin: albedo, relief, gloss, from pigments, region masks and solid noise.

#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "likeness/geometry/mesh.h"
#include "likeness/simulate/head.h"
#include "likeness/simulate/human/recipe.h"

namespace likeness {

// Grey masks in MakeHuman's own texture coordinates.
struct SkinMasks {
  ImageU8 lips, ears, eyelids;
};
// Throws Error when DATA/mpfb2/textures lacks one.
SkinMasks ReadSkinMasks(const std::filesystem::path& data_folder);

// What is painted on: the skin surface at rest.
struct SkinSheet {
  const MeshTopology* topology = nullptr;
  Vertices points;                                            // the person, head space, mm
  Vertices average;                                           // the same vertices in the space of skin_regions.h
  std::vector<std::array<Eigen::Vector2f, 3>> makehuman_uvs;  // one entry a triangle
  int first_mouth_triangle = 0;           // from here on triangles belong to the inside of the mouth
  std::vector<Eigen::Vector3f> lid_rims;  // points along the rims of the lids, average space
};

// A material whose maps have recipe.texture_size texels a side. Relief is solid noise too, so maps fit across seams.
Material PaintSkin(const SkinSheet& sheet, const SkinMasks& masks, const HumanRecipe& recipe);

}  // namespace likeness
