// The mesh that a tracker would give of a human head: one skin-like surface of fixed topology, finer in the face. Over
// the scalp a tracker finds the cropped hair's surface; human_head.cc lifts it there.

#pragma once

#include <array>
#include <vector>

#include "likeness/simulate/human/atlas.h"
#include "likeness/simulate/human/identity.h"

namespace likeness {

// Fine rows and columns between the lids, twice those of the atlas.
inline constexpr int kFinePatchRows = 2 * kPatchRows;

// Closes one lid opening.
struct EyePatch {
  // Tracked vertices of the lids, from corner to corner.
  std::vector<int> upper, lower;
  // Tracked vertices between them, [column - 1][row - 1] for columns and rows between the lids.
  std::vector<std::array<int, kFinePatchRows - 1>> inner;
};

// Vertices are a subset of the subdivided skin's, so both surfaces coincide there, followed by those of the patches.
struct TrackedMesh {
  MeshTopology topology;
  std::vector<int> skin_vertices;   // for each tracked vertex before the patches: its index in the fine skin
  std::array<EyePatch, 2> patches;  // by Side

  // Positions from those of the fine skin. Patch vertices lie on straight columns from lid to lid, lifted off the eye
  // so that none is nearer to its centre than the radius and kPatchClearance.
  Vertices Positions(const Vertices& fine_skin, const std::array<EyeFit, 2>& eyes) const;
};
inline constexpr float kPatchClearance = 0.3f;  // mm

inline constexpr int kTrackedVertices = 7000;  // reached to within one quad's share

//   skin  the subdivision whose coarse quads are BaseMesh's face and then mouth (and more that is not tracked),
//         with base mesh vertex indices
TrackedMesh BuildTrackedMesh(const BaseMesh& base, const HeadAtlas& atlas, const Subdivision& skin);

}  // namespace likeness
