// The head of MakeHuman's base mesh: which of its quads are skin, mouth, sockets, teeth and so on.

#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "likeness/geometry/mesh.h"
#include "likeness/simulate/gaze.h"
#include "likeness/simulate/human/subdivide.h"

namespace likeness {

struct QuadPart {
  std::vector<Quad> quads;                          // vertex indices of the base mesh
  std::vector<std::array<Eigen::Vector2f, 4>> uvs;  // MakeHuman's own, one a corner
};

struct BaseMesh {
  Vertices vertices;                // the whole body, millimetres
  QuadPart face;                    // face, scalp, ears and neck
  QuadPart mouth;                   // inside of the mouth
  std::array<QuadPart, 2> sockets;  // by Side
  std::array<QuadPart, 2> eyes;
  std::array<std::array<QuadPart, 2>, 2> lashes;  // by Side, then lower and upper
  QuadPart upper_teeth, lower_teeth, tongue;
};

inline constexpr float kMillimetresPerUnit = 100;  // the data are in decimetres

// Reads DATA/mpfb2/3dobjs/base.obj. Throws Error when it is another mesh than the one described above.
BaseMesh ReadBaseMesh(const std::filesystem::path& data_folder);

// Indices of the vertices that quads use, ascending.
std::vector<int> UsedVertices(const std::vector<Quad>& quads);

// Border edges (used by one quad only) as closed loops of vertices, each in the direction of its quads.
std::vector<std::vector<int>> BorderLoops(const std::vector<Quad>& quads);

}  // namespace likeness
