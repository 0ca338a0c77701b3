// Wavefront OBJ: polygons with texture coordinates and groups.

#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/geometry/mesh.h"

namespace likeness {

struct ObjPolygon {
  std::vector<int> vertices;  // 0-based
  std::vector<int> uvs;       // 0-based, as many as vertices; empty when the file gives none
  int group = 0;              // index into ObjFile::groups
};

struct ObjFile {
  Vertices vertices;  // the file's own units
  std::vector<Eigen::Vector2f> uvs;
  std::vector<std::string> groups;  // "" for polygons before the first `g` or `o`
  std::vector<ObjPolygon> polygons;
};

// Reads v, vt, f, g and o; skips every other statement. Negative (relative) indices are understood. Throws Error, with
// the line, for malformed numbers, indices out of range, polygons of fewer than three corners.
ObjFile ReadObj(const std::filesystem::path& path);
ObjFile ParseObj(const std::filesystem::path& path_for_errors, std::string_view text);

// Polygons cut into fans of triangles. Throws Error when a polygon has no texture coordinates.
MeshTopology TopologyFromObj(const ObjFile& obj, const std::string& what);

// Writes `v`, `vt`, `f v/vt`, with the digits that a float needs to come back unchanged.
std::string ObjText(const Vertices& vertices, const MeshTopology& topology);
void WriteObj(const std::filesystem::path& path, const Vertices& vertices, const MeshTopology& topology);

}  // namespace likeness
