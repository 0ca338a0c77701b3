// The mesh that a tracker would give of a model's head: its face, scalp, ears and neck with the inside of the mouth as
// one surface whose only border is at the neck. Lid openings are closed by patches that follow the lids.

#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "likeness/simulate/glb/head_model.h"

namespace likeness {

// A point on a border: between two neighbouring tracked vertices.
struct BorderPoint {
  int a = 0, b = 0;
  float t = 0;  // 0: at a, 1: at b
};

// Closes one lid opening: columns from the upper to the lower lid.
struct LidPatch {
  bool closed = false;                   // false: this eye has no opening
  std::vector<int> upper, lower;         // tracked vertices of the lids from corner to corner, growing x
  std::vector<BorderPoint> top, bottom;  // ends of the columns between the corners
  int first = 0;                         // tracked vertex of column c, row r: first + c * (kLidRows - 1) + r - 1
};
inline constexpr int kLidRows = 8;              // rows of triangles from lid to lid
inline constexpr float kLidClearanceMm = 0.3f;  // patches and moving lids keep this far off the eye

// Closes any other hole by triangles around a vertex in the middle of its border.
struct HolePatch {
  std::vector<int> border;
  int middle = 0;
};

enum class Region : uint8_t { kOutside, kMouth, kPatch };

struct ClosedSurface {
  int vertex_count = 0;
  std::vector<Eigen::Vector3i> triangles;  // counter-clockwise seen from outside
  std::vector<Region> regions;             // one a triangle
  std::vector<int> model_vertices;         // for each tracked vertex before the patches'
  std::array<LidPatch, 2> lids;            // by Side
  std::vector<HolePatch> holes;
  std::vector<int> neck;  // the border that is left, in the direction of the triangles
  // Of the triangles before the patches': the model's surface and triangle that each is.
  std::vector<std::pair<int, int>> sources;

  // Tracked positions from the model's.
  Vertices Positions(const Vertices& model, const std::array<ModelEye, 2>& eyes) const;
};

// Where a mesh goes on behind the lids into a socket, what cannot be seen from the front of the eye is left out, so
// that an opening remains. The inside of the mouth is what cannot be seen from outside at rest.
//   most_vertices  a finer skin is simplified to about this many
// Throws Error, naming the file, when no skin moves with the expressions.
ClosedSurface CloseSurface(const std::filesystem::path& path_for_errors, const HeadModel& model,
                           int most_vertices = 20000);

}  // namespace likeness
