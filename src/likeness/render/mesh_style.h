// How a mesh is drawn in a window.

#pragma once

#include <array>

namespace likeness {

// What is drawn of a mesh: lines are its edges, but for those that the mesh itself hides.
enum class MeshFill { kTexture, kTextureAndLines, kLines };

struct MeshStyle {
  MeshFill surface = MeshFill::kTexture;
  bool cull_back_faces = true;
  float exposure = 1;  // the texture's light, taking it for sRGB-encoded, is multiplied by this
  std::array<float, 3> line_colour = {0.55f, 0.8f, 1};  // RGB, 0 ... 1
};

}  // namespace likeness
