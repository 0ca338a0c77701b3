// How far two states of one mesh are apart, over the vertices that are seen: those that belong to triangles.

#pragma once

#include <vector>

#include "likeness/geometry/mesh.h"

namespace likeness {

std::vector<int> VerticesInTriangles(const MeshTopology& topology);  // ascending, each once

// Mean distance of the listed vertices from `a` to `b`, in their unit. `vertices` is not empty.
double MeanDistance(const Vertices& a, const Vertices& b, const std::vector<int>& vertices);

}  // namespace likeness
