// PLY meshes: positions and triangles, as published captures store registered heads.

#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/geometry/mesh.h"

namespace likeness {

struct PlyFile {
  Vertices vertices;                       // the file's own units
  std::vector<Eigen::Vector3i> triangles;  // polygons cut into fans; empty when the file has no faces
};

// ASCII, binary little-endian and binary big-endian; x, y and z of any scalar type; all other elements and properties
// are stepped over. Throws Error for headers that are not understood, values that are not finite, indices out of range,
// and counts that the file is too short for, before memory is allocated for them.
PlyFile ParsePly(const std::filesystem::path& path_for_errors, std::string_view bytes);

enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };

// float32 x, y, z and, where there are any, faces.
std::string EncodePly(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles,
                      PlyEncoding encoding = PlyEncoding::kLittleEndian);

}  // namespace likeness
