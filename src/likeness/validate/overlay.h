// Pictures of the evidence: meshes laid over camera images.

#pragma once

#include "likeness/validate/view_fit.h"

namespace likeness {

// The picture, twice as large, with the mesh shaded over it in `tint` where it is placed, and its outline.
ImageU8 DrawMeshOver(const View& view, const Placement& placement, const Vertices& vertices,
                     const MeshTopology& topology, const std::array<uint8_t, 3>& tint);

}  // namespace likeness
