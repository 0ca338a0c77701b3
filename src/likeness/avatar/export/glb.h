// Animated meshes as binary glTF 2.0 (.glb), which browsers, Blender and game engines open. One mesh with a baked
// texture that is shown as it is (KHR_materials_unlit: light is in the picture), morph targets and a node that carries
// the head's motion; in metres, y up, the face along +z, as the format asks.
// https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html

#pragma once

#include <string>
#include <vector>

#include "likeness/avatar/export/animated_mesh.h"
#include "likeness/image/image.h"

namespace likeness {

// The whole file. Vertices on a seam of the texture appear once for each of their texture coordinates, in the order of
// MeshCorners.
//   texture  RGB, row 0 is v = 1
std::string GlbBytes(const AnimatedMesh& mesh, const ImageU8& texture);

}  // namespace likeness
