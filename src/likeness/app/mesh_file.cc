#include "likeness/app/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/geometry/obj.h"
#include "likeness/geometry/ply.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

MeshTopology FacesAlone(const ObjFile& obj) {
  MeshTopology topology;
  topology.vertex_count = static_cast<int>(obj.vertices.rows());
  for (const ObjPolygon& polygon : obj.polygons) {
    for (size_t i = 2; i < polygon.vertices.size(); ++i) {
      topology.triangles.emplace_back(polygon.vertices[0], polygon.vertices[i - 1], polygon.vertices[i]);
    }
  }
  return topology;
}

MeshTopology FromObj(const ObjFile& obj, const fs::path& path) {
  const bool has_uvs =
      std::all_of(obj.polygons.begin(), obj.polygons.end(), [](const ObjPolygon& p) { return !p.uvs.empty(); });
  if (!has_uvs) return FacesAlone(obj);
  MeshTopology topology = TopologyFromObj(obj, path.string());
  topology.Check(path.string());
  return topology;
}

}  // namespace

bool IsMeshFile(const fs::path& path) {
  const std::string ending = path.extension().string();
  return ending == ".bin" || ending == ".obj" || ending == ".ply";
}

MeshFile ReadMeshFile(const fs::path& path, const fs::path& topology_file) {
  MeshFile mesh;
  const std::string ending = path.extension().string();
  if (ending == ".obj") {
    const ObjFile obj = ReadObj(path);
    mesh.vertices = obj.vertices;
    mesh.topology = FromObj(obj, path);
  } else if (ending == ".ply") {
    PlyFile ply = ParsePly(path, ReadFile(path));
    mesh.vertices = std::move(ply.vertices);
    mesh.topology.triangles = std::move(ply.triangles);
  } else {
    const std::vector<float> values = ReadFloats(path);
    if (values.empty() || values.size() % 3 != 0) {
      throw FileError(path, fmt::format("holds {} float32 values; expected x, y, z of vertices", values.size()));
    }
    mesh.vertices = Eigen::Map<const Vertices>(values.data(), static_cast<Eigen::Index>(values.size() / 3), 3);
  }
  mesh.topology.vertex_count = static_cast<int>(mesh.vertices.rows());
  if (!topology_file.empty()) {
    mesh.topology = FromObj(ReadObj(topology_file), topology_file);
    if (mesh.topology.vertex_count != mesh.vertices.rows()) {
      throw FileError(topology_file, fmt::format("is for {} vertices, but {} has {}", mesh.topology.vertex_count,
                                                 path.string(), mesh.vertices.rows()));
    }
  }
  if (mesh.topology.triangles.empty()) {
    throw FileError(topology_file.empty() ? path : topology_file,
                    "has no faces; name an .obj that has them with --topology");
  }
  return mesh;
}

}  // namespace likeness
