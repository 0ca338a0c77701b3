#include "likeness/simulate/human/base_mesh.h"

#include <algorithm>
#include <map>
#include <set>

#include "likeness/base/error.h"
#include "likeness/geometry/obj.h"

namespace likeness {
namespace {

// Head and neck are what lies above the shoulders and between the arms, in the file's decimetres.
constexpr float kNeckY = 6.0f;
constexpr float kArmX = 1.0f;

// The cut through the neck follows the quads and so has steps. Smooths its border, and the skin just above with it, and
// lets quads at the steps start at their outer corner: where a border is laid out straight, cutting them into
// triangles from there leaves none without area.
void SmoothNeckBorder(BaseMesh* mesh) {
  std::vector<int> border;
  for (std::vector<int>& loop : BorderLoops(mesh->face.quads)) {
    if (loop.size() > border.size()) border = std::move(loop);  // lids have 28 vertices, the lips 38
  }
  std::map<int, size_t> place;
  for (size_t i = 0; i < border.size(); ++i) place[border[i]] = i;
  for (size_t q = 0; q < mesh->face.quads.size(); ++q) {
    Quad& quad = mesh->face.quads[q];
    for (int k = 0; k < 4; ++k) {
      const auto a = place.find(quad[(k + 3) % 4]), b = place.find(quad[k]), c = place.find(quad[(k + 1) % 4]);
      if (a == place.end() || b == place.end() || c == place.end()) continue;
      if ((a->second + 1) % border.size() != b->second || (b->second + 1) % border.size() != c->second) continue;
      std::rotate(quad.begin(), quad.begin() + k, quad.end());
      std::rotate(mesh->face.uvs[q].begin(), mesh->face.uvs[q].begin() + k, mesh->face.uvs[q].end());
      break;
    }
  }

  const auto smooth = [&](const std::map<int, std::set<int>>& neighbours, int rounds) {
    for (int round = 0; round < rounds; ++round) {
      const Vertices before = mesh->vertices;
      for (const auto& [v, others] : neighbours) {
        Eigen::RowVector3f mean = Eigen::RowVector3f::Zero();
        for (const int other : others) mean += before.row(other);
        mesh->vertices.row(v) = (before.row(v) + mean / static_cast<float>(others.size())) / 2;
      }
    }
  };
  std::map<int, std::set<int>> along_border, above;
  for (size_t i = 0; i < border.size(); ++i) {
    const int a = border[i], b = border[(i + 1) % border.size()];
    along_border[a].insert(b);
    along_border[b].insert(a);
  }
  constexpr float kAbove = 30;  // mm over the cut
  for (const Quad& quad : mesh->face.quads) {
    for (int k = 0; k < 4; ++k) {
      const int v = quad[k];
      if (place.contains(v) || mesh->vertices(v, 1) > kNeckY * kMillimetresPerUnit + kAbove) continue;
      above[v].insert({quad[(k + 1) % 4], quad[(k + 3) % 4]});
    }
  }
  smooth(along_border, 60);
  smooth(above, 10);
}

}  // namespace

BaseMesh ReadBaseMesh(const std::filesystem::path& data_folder) {
  const std::filesystem::path path = data_folder / "mpfb2" / "3dobjs" / "base.obj";
  const ObjFile obj = ReadObj(path);
  BaseMesh mesh;
  mesh.vertices = obj.vertices * kMillimetresPerUnit;
  const std::map<std::string, QuadPart*> helpers = {
      {"helper-l-eye", &mesh.eyes[kLeft]},
      {"helper-r-eye", &mesh.eyes[kRight]},
      {"helper-l-eyelashes-1", &mesh.lashes[kLeft][0]},
      {"helper-l-eyelashes-2", &mesh.lashes[kLeft][1]},
      {"helper-r-eyelashes-1", &mesh.lashes[kRight][0]},
      {"helper-r-eyelashes-2", &mesh.lashes[kRight][1]},
      {"helper-upper-teeth", &mesh.upper_teeth},
      {"helper-lower-teeth", &mesh.lower_teeth},
      {"helper-tongue", &mesh.tongue},
  };
  for (const ObjPolygon& polygon : obj.polygons) {
    const std::string& group = obj.groups[polygon.group];
    const auto helper = helpers.find(group);
    if (group != "body" && helper == helpers.end()) continue;
    if (polygon.vertices.size() != 4 || polygon.uvs.size() != 4) {
      throw FileError(path, "has polygons other than quads with texture coordinates; expected MakeHuman's base mesh");
    }
    Quad quad;
    std::array<Eigen::Vector2f, 4> uvs;
    bool in_head = true;
    for (int k = 0; k < 4; ++k) {
      quad[k] = polygon.vertices[k];
      uvs[k] = obj.uvs[polygon.uvs[k]];
      in_head &= obj.vertices(quad[k], 1) > kNeckY && std::abs(obj.vertices(quad[k], 0)) < kArmX;
    }
    QuadPart* part = nullptr;
    if (helper != helpers.end()) {
      part = helper->second;
    } else if (in_head) {
      // The charts of MakeHuman's atlas tell the regions apart.
      const Eigen::Vector2f centre = (uvs[0] + uvs[1] + uvs[2] + uvs[3]) / 4;
      if (centre.x() < 0.16f) {
        part = &mesh.sockets[obj.vertices(quad[0], 0) > 0 ? kLeft : kRight];
      } else if (centre.y() < 0.14f) {
        part = &mesh.mouth;
      } else {
        part = &mesh.face;
      }
    }
    if (part == nullptr) continue;
    part->quads.push_back(quad);
    part->uvs.push_back(uvs);
  }
  const auto expect = [&](const QuadPart& part, size_t quads, const char* what) {
    if (part.quads.size() == quads) return;
    throw FileError(path, fmt::format("has {} quads in the {}, expected {}: this is not MakeHuman's base mesh",
                                      part.quads.size(), what, quads));
  };
  expect(mesh.face, 3236, "face and neck");
  expect(mesh.mouth, 398, "mouth");
  expect(mesh.upper_teeth, 48, "upper teeth");
  expect(mesh.lower_teeth, 48, "lower teeth");
  expect(mesh.tongue, 224, "tongue");
  for (const int side : {kLeft, kRight}) {
    expect(mesh.sockets[side], 293, "eye socket");
    expect(mesh.eyes[side], 70, "eye");
    expect(mesh.lashes[side][0], 44, "lower lashes");
    expect(mesh.lashes[side][1], 48, "upper lashes");
  }
  SmoothNeckBorder(&mesh);
  return mesh;
}

std::vector<int> UsedVertices(const std::vector<Quad>& quads) {
  std::set<int> used;
  for (const Quad& quad : quads) used.insert(quad.begin(), quad.end());
  return {used.begin(), used.end()};
}

std::vector<std::vector<int>> BorderLoops(const std::vector<Quad>& quads) {
  std::set<std::pair<int, int>> directed;
  for (const Quad& quad : quads) {
    for (int k = 0; k < 4; ++k) directed.emplace(quad[k], quad[(k + 1) % 4]);
  }
  std::map<int, int> next;
  for (const auto& [a, b] : directed) {
    if (a != b && !directed.contains({b, a})) next[a] = b;
  }
  std::vector<std::vector<int>> loops;
  while (!next.empty()) {
    std::vector<int> loop;
    for (auto it = next.begin(); it != next.end(); it = next.find(loop.back())) {
      loop.push_back(it->second);
      next.erase(it);
    }
    loops.push_back(std::move(loop));
  }
  return loops;
}

}  // namespace likeness
