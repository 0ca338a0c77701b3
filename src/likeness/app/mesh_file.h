// One mesh in a file of its own, outside of any capture.

#pragma once

#include <filesystem>

#include "likeness/geometry/mesh.h"

namespace likeness {

struct MeshFile {
  Vertices vertices;      // the file's own units
  MeshTopology topology;  // without texture coordinates where no file gives them

  bool HasUvs() const { return topology.triangle_uvs.size() == topology.triangles.size(); }
};

// Whether a path ends as such files do: .bin, .obj, .ply.
bool IsMeshFile(const std::filesystem::path& path);

// Positions from `path` (.bin: float32 x, y, z), faces and texture coordinates from the .obj `topology_file` where one
// is named, otherwise from the file itself. Throws Error where there are no faces or the counts differ.
MeshFile ReadMeshFile(const std::filesystem::path& path, const std::filesystem::path& topology_file);

}  // namespace likeness
