// A mesh's connectivity and texture coordinates as tensors.

#pragma once

#include <torch/types.h>

#include "likeness/geometry/mesh.h"

namespace likeness {

struct RenderTopology {
  torch::Tensor triangles;     // [T, 3] int64, vertices
  torch::Tensor triangle_uvs;  // [T, 3] int64, texture coordinates
  torch::Tensor neighbours;    // [T, 3] int64, the triangle across the edge from corner j to the next; -1: none
  torch::Tensor uvs;           // [U, 2]; v = 1 is a texture's first row

  RenderTopology() = default;
  RenderTopology(const MeshTopology& topology, torch::TensorOptions options);  // type and device of uvs
};

}  // namespace likeness
