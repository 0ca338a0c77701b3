// One texture atlas without overlap for a model's tracked surface: the model's own where that is good, otherwise two
// rectangles that fill it, above for face, scalp, ears and neck with the lid patches in their places, below for the
// inside of the mouth.

#pragma once

#include <filesystem>
#include <vector>

#include "likeness/simulate/glb/closed_surface.h"

namespace likeness {

struct SurfaceAtlas {
  std::vector<Eigen::Vector2f> uvs;
  std::vector<Eigen::Vector3i> triangle_uvs;  // one a triangle of the surface
  bool is_own = false;                        // the model's own texture coordinates were used
  float own_fill = 0;  // part of the texture that these cover; 0 where they overlap or are absent
  float fill = 0;      // part of the texture that is covered
};

// The model's own coordinates are used when no two triangles share texels, all lie in [0, 1], patches have texels like
// the skin around them, and at least this part of the texture is covered.
inline constexpr float kLeastOwnFill = 0.6f;

//   rest  tracked positions at rest
// u grows to the subject's left over the face, as with human heads. Throws Error, naming the file, when the surface is
// no disc (its skin has handles) and its own coordinates are no good either.
SurfaceAtlas MakeSurfaceAtlas(const std::filesystem::path& path_for_errors, const ClosedSurface& surface,
                              const Vertices& rest, const HeadModel& model);

}  // namespace likeness
