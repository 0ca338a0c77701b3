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
// GltfCorners.
//   texture  RGB, row 0 is v = 1
std::string GlbBytes(const AnimatedMesh& mesh, const ImageU8& texture);

// The vertices of the file: which of the mesh's each is, and with which texture coordinate.
struct GltfCorners {
  std::vector<int> vertices;
  std::vector<int> uvs;
  std::vector<uint32_t> indices;  // three a triangle, into the two above
};
GltfCorners CornersOf(const MeshTopology& topology);

}  // namespace likeness
