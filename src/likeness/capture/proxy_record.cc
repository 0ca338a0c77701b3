#include "likeness/capture/proxy_record.h"

#include <nlohmann/json.hpp>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/json.h"

namespace likeness {
namespace {

std::filesystem::path RecordPath(const std::filesystem::path& root) { return root / "geometry.json"; }

}  // namespace

Geometry ParseGeometryRecord(const std::filesystem::path& path_for_errors, std::string_view bytes) {
  const nlohmann::json json = ParseJson(path_for_errors, bytes);
  if (!json.is_object() || !json.contains("geometry") || !json["geometry"].is_string()) {
    throw FileError(path_for_errors, R"(expected {"geometry": NAME})");
  }
  try {
    return ParseGeometry(json["geometry"]);
  } catch (const Error& error) {
    throw FileError(path_for_errors, error.what());
  }
}

Geometry GeometryOf(const std::filesystem::path& capture_root) {
  const std::filesystem::path path = RecordPath(capture_root);
  return Exists(path) ? ParseGeometryRecord(path, ReadFile(path, 1 << 16)) : Geometry::kTracked;
}

void WriteGeometry(const std::filesystem::path& capture_root, Geometry geometry) {
  WriteFile(RecordPath(capture_root), nlohmann::json({{"geometry", ToString(geometry)}}).dump() + "\n");
}

}  // namespace likeness
