// The file that says that a capture's meshes are not the tracked ones: ROOT/geometry.json, of ours.

#pragma once

#include <filesystem>
#include <string_view>

#include "likeness/avatar/architecture.h"

namespace likeness {

// What a capture's meshes are: as its record says; tracked where there is none. Throws Error for a damaged one.
Geometry GeometryOf(const std::filesystem::path& capture_root);
Geometry ParseGeometryRecord(const std::filesystem::path& path_for_errors, std::string_view bytes);

// Whether the mesh is the same in every frame: there is nothing to learn of it.
inline bool StandsStill(Geometry geometry) {
  return geometry == Geometry::kEllipsoid || geometry == Geometry::kBillboard;
}

void WriteGeometry(const std::filesystem::path& capture_root, Geometry geometry);

}  // namespace likeness
