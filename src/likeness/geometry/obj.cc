#include "likeness/geometry/obj.h"

#include <fmt/compile.h>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

// An index of the file (1-based, or negative from the end) as a 0-based one.
int ResolveIndex(const TextLines& lines, std::string_view word, size_t count, const char* kind) {
  const int64_t index = lines.Integer(word);
  const int64_t resolved = index < 0 ? static_cast<int64_t>(count) + index : index - 1;
  if (index == 0 || resolved < 0 || resolved >= static_cast<int64_t>(count)) {
    lines.Fail(fmt::format("{} {} does not exist; the file has {} up to here", kind, index, count));
  }
  return static_cast<int>(resolved);
}

ObjPolygon ParsePolygon(const TextLines& lines, const std::vector<std::string_view>& words, size_t vertex_count,
                        size_t uv_count) {
  ObjPolygon polygon;
  for (size_t i = 1; i < words.size(); ++i) {
    const std::string_view word = words[i];
    const size_t slash = word.find('/');
    polygon.vertices.push_back(ResolveIndex(lines, word.substr(0, slash), vertex_count, "vertex"));
    if (slash == std::string_view::npos) continue;
    const std::string_view rest = word.substr(slash + 1);
    const std::string_view uv = rest.substr(0, rest.find('/'));
    if (!uv.empty()) polygon.uvs.push_back(ResolveIndex(lines, uv, uv_count, "texture coordinate"));
  }
  if (polygon.vertices.size() < 3) lines.Fail("a face needs at least three corners");
  if (!polygon.uvs.empty() && polygon.uvs.size() != polygon.vertices.size()) {
    lines.Fail("some corners of this face have texture coordinates and some have none");
  }
  return polygon;
}

}  // namespace

ObjFile ReadObj(const std::filesystem::path& path) { return ParseObj(path, ReadFile(path)); }

ObjFile ParseObj(const std::filesystem::path& path_for_errors, std::string_view text) {
  ObjFile obj;
  std::vector<Eigen::RowVector3f> vertices;
  std::map<std::string, int, std::less<>> group_indices;
  int group = -1;
  const auto enter_group = [&](std::string_view name) {
    const auto [it, added] = group_indices.try_emplace(std::string(name), static_cast<int>(obj.groups.size()));
    if (added) obj.groups.emplace_back(name);
    group = it->second;
  };
  TextLines lines(path_for_errors, text);
  while (lines.Next()) {
    const auto words = lines.Words();
    if (words.empty() || words[0].starts_with('#')) continue;
    if (words[0] == "v") {
      if (words.size() < 4) lines.Fail("a vertex needs three numbers");
      vertices.emplace_back(lines.Float(words[1]), lines.Float(words[2]), lines.Float(words[3]));
    } else if (words[0] == "vt") {
      if (words.size() < 3) lines.Fail("a texture coordinate needs two numbers");
      obj.uvs.emplace_back(lines.Float(words[1]), lines.Float(words[2]));
    } else if (words[0] == "g" || words[0] == "o") {
      enter_group(words.size() > 1 ? words[1] : "");
    } else if (words[0] == "f") {
      if (group < 0) enter_group("");
      obj.polygons.push_back(ParsePolygon(lines, words, vertices.size(), obj.uvs.size()));
      obj.polygons.back().group = group;
    }
  }
  if (vertices.empty()) throw FileError(path_for_errors, "holds no vertices; expected a Wavefront OBJ");
  obj.vertices.resize(static_cast<Eigen::Index>(vertices.size()), 3);
  for (size_t i = 0; i < vertices.size(); ++i) obj.vertices.row(static_cast<Eigen::Index>(i)) = vertices[i];
  return obj;
}

MeshTopology TopologyFromObj(const ObjFile& obj, const std::string& what) {
  MeshTopology topology;
  topology.vertex_count = static_cast<int>(obj.vertices.rows());
  topology.uvs = obj.uvs;
  for (const ObjPolygon& polygon : obj.polygons) {
    if (polygon.uvs.empty()) throw Error("{}: a face has no texture coordinates (f v/vt)", what);
    for (size_t i = 2; i < polygon.vertices.size(); ++i) {
      topology.triangles.emplace_back(polygon.vertices[0], polygon.vertices[i - 1], polygon.vertices[i]);
      topology.triangle_uvs.emplace_back(polygon.uvs[0], polygon.uvs[i - 1], polygon.uvs[i]);
    }
  }
  return topology;
}

std::string ObjText(const Vertices& vertices, const MeshTopology& topology) {
  std::string text;
  const auto out = std::back_inserter(text);
  for (const auto& v : vertices.rowwise()) fmt::format_to(out, FMT_COMPILE("v {} {} {}\n"), v[0], v[1], v[2]);
  for (const auto& uv : topology.uvs) fmt::format_to(out, FMT_COMPILE("vt {} {}\n"), uv[0], uv[1]);
  for (size_t i = 0; i < topology.triangles.size(); ++i) {
    const Eigen::Vector3i v = topology.triangles[i].array() + 1, t = topology.triangle_uvs[i].array() + 1;
    fmt::format_to(out, FMT_COMPILE("f {}/{} {}/{} {}/{}\n"), v[0], t[0], v[1], t[1], v[2], t[2]);
  }
  return text;
}

void WriteObj(const std::filesystem::path& path, const Vertices& vertices, const MeshTopology& topology) {
  WriteFile(path, ObjText(vertices, topology));
}

}  // namespace likeness
