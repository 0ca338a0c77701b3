// A head's mesh from the front and both sides: enough to see a texture that is flipped or mirrored.

#pragma once

#include <array>
#include <vector>

#include "likeness/geometry/camera.h"
#include "likeness/geometry/mesh.h"
#include "likeness/image/image.h"
#include "likeness/image/panels.h"

namespace likeness {

// From the left of the picture to its right: the subject's right side, the front, the subject's left side.
inline constexpr std::array<double, 3> kViewAzimuthsDeg = {-50, 0, 50};

// As grey clay, lit from beside the camera, on the ground of MeshViews. Needs no texture coordinates.
ImageU8 DrawShadedMesh(const Vertices& vertices_in_head, const MeshTopology& topology, const Camera& camera);

// One labelled view of 3 : 4 for each azimuth, for image/panels.h, with the texture where one is given, else shaded. As
// in a photograph, the subject's left is at the right of the front view.
//   texture  RGB, 0 ... 255, row 0 is v = 1; null: shaded
//   height   px, 64 ... 4096
std::vector<Panel> MeshViews(const Vertices& vertices_in_head, const MeshTopology& topology, const ImageU8* texture,
                             int height);

}  // namespace likeness
