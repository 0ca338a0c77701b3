// The parts of a scene in one list of vertices, with the 52 expressions made from their morph targets.

#pragma once

#include <string>
#include <vector>

#include "likeness/simulate/glb/gltf_scene.h"
#include "likeness/simulate/glb/part_kind.h"
#include "likeness/simulate/glb/shape_names.h"
#include "likeness/simulate/human/target.h"

namespace likeness {

inline constexpr float kMmPerUnit = 1000;  // glTF is in metres

// Triangles of one kind and material. Vertices are those of the whole model, texture coordinates the surface's own.
struct ModelSurface {
  std::string name;
  PartKind kind = PartKind::kSkin;
  int material = -1;
  std::vector<Eigen::Vector3i> triangles;
  std::vector<Eigen::Vector3i> triangle_uvs;
  std::vector<Eigen::Vector2f> uvs;
};

struct Gathered {
  Vertices positions;          // millimetres
  std::vector<Target> shapes;  // kExpressionCount; vertices ascending
  std::vector<ModelSurface> surfaces;
};

// One surface a part. Vertices are still parted along seams of texture coordinates.
Gathered GatherParts(const GltfScene& scene, const ShapeMap& map);

// Makes one vertex of those of the same kind of part that lie in one place (5 micrometres) and move alike.
void JoinSeams(Gathered* all);

// Indices that triangles use, ascending.
std::vector<int> VerticesOf(const std::vector<Eigen::Vector3i>& triangles);

}  // namespace likeness
