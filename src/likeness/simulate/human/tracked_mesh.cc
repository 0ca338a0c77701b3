#include "likeness/simulate/human/tracked_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "likeness/base/error.h"

namespace likeness {
namespace {

struct Corner {
  int vertex;
  int uv;
};

// Cuts a convex polygon with up to one point inside each side of a quad into triangles without slivers: fans from such
// a point where there is one.
void AppendPolygon(const std::vector<Corner>& polygon, const std::vector<bool>& is_middle, MeshTopology* topology) {
  const size_t n = polygon.size();
  const auto middle = std::find(is_middle.begin(), is_middle.end(), true);
  const size_t start = middle == is_middle.end() ? 0 : static_cast<size_t>(middle - is_middle.begin());
  for (size_t i = 1; i + 1 < n; ++i) {
    const Corner& a = polygon[start];
    const Corner& b = polygon[(start + i) % n];
    const Corner& c = polygon[(start + i + 1) % n];
    topology->triangles.emplace_back(a.vertex, b.vertex, c.vertex);
    topology->triangle_uvs.emplace_back(a.uv, b.uv, c.uv);
  }
}

// The coarse quads to subdivide: all around the lids, then the nearest to the face's centre, as many as reach the
// wanted number of vertices. The inside of the mouth counts as farther away.
std::vector<bool> ChooseFineQuads(const BaseMesh& base, const HeadAtlas& atlas, const Subdivision& skin,
                                  size_t quad_count, int patch_vertices) {
  const Eigen::Vector3f centre(0, 700, 135);
  std::set<int> coarse, lids;
  for (const SlitLoop& loop : atlas.lids) {
    lids.insert(loop.upper.begin(), loop.upper.end());
    lids.insert(loop.lower.begin(), loop.lower.end());
  }
  std::vector<float> distance(quad_count);
  for (size_t q = 0; q < quad_count; ++q) {
    Eigen::Vector3f middle = Eigen::Vector3f::Zero();
    bool at_lid = false;
    for (const int v : skin.coarse_quads[q]) {
      middle += base.vertices.row(v).transpose() / 4;
      coarse.insert(v);
      at_lid |= lids.contains(v);
    }
    const float inside = q < base.face.quads.size() ? 1.0f : 2.0f;
    distance[q] = at_lid ? 0 : inside * (middle - centre).norm();
  }
  std::vector<size_t> order(quad_count);
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return distance[a] < distance[b]; });
  std::vector<bool> fine(quad_count, false);
  std::set<int> added;
  for (const size_t q : order) {
    if (static_cast<int>(coarse.size() + added.size()) + patch_vertices >= kTrackedVertices) break;
    fine[q] = true;
    for (int k = 0; k < 4; ++k) added.insert({skin.quads[4 * q + k][1], skin.quads[4 * q + k][2]});
  }
  return fine;
}

}  // namespace

TrackedMesh BuildTrackedMesh(const BaseMesh& base, const HeadAtlas& atlas, const Subdivision& skin) {
  TrackedMesh mesh;
  MeshTopology& topology = mesh.topology;
  std::vector<Quad> coarse_uvs = atlas.face;
  coarse_uvs.insert(coarse_uvs.end(), atlas.mouth.begin(), atlas.mouth.end());
  const size_t quad_count = coarse_uvs.size();
  const Subdivision uvs = Subdivide(coarse_uvs, static_cast<int>(atlas.uvs.size()));
  const std::vector<Eigen::Vector2f> fine_uvs = SubdivideUvs(uvs, atlas.uvs);

  int patch_vertices = 0;
  for (const SlitLoop& lids : atlas.lids) patch_vertices += (2 * lids.segments() - 1) * (kFinePatchRows - 1);
  const std::vector<bool> fine = ChooseFineQuads(base, atlas, skin, quad_count, patch_vertices);

  // Vertices of the fine skin are collected as triangles use them, in ascending order.
  std::set<int> split;  // fine edge points that exist because a neighbour is subdivided
  for (size_t q = 0; q < quad_count; ++q) {
    for (int k = 0; fine[q] && k < 4; ++k) split.insert(skin.quads[4 * q + k][1]);
  }
  for (size_t q = 0; q < quad_count; ++q) {
    std::vector<Corner> outline;
    std::vector<bool> is_middle;
    for (int k = 0; k < 4; ++k) {
      const Quad& vertices = skin.quads[4 * q + k];
      const Quad& texels = uvs.quads[4 * q + k];
      if (fine[q]) {
        AppendPolygon(
            {{vertices[0], texels[0]}, {vertices[1], texels[1]}, {vertices[2], texels[2]}, {vertices[3], texels[3]}},
            {false, false, false, false}, &topology);
        continue;
      }
      outline.push_back({vertices[0], texels[0]});
      is_middle.push_back(false);
      if (split.contains(vertices[1])) {
        outline.push_back({vertices[1], texels[1]});
        is_middle.push_back(true);
      }
    }
    if (!fine[q]) AppendPolygon(outline, is_middle, &topology);
  }
  std::map<int, int> tracked_from_fine;
  for (const Eigen::Vector3i& t : topology.triangles) {
    for (int k = 0; k < 3; ++k) tracked_from_fine[t[k]] = 0;
  }
  for (auto& [fine_vertex, index] : tracked_from_fine) {
    index = static_cast<int>(mesh.skin_vertices.size());
    mesh.skin_vertices.push_back(fine_vertex);
  }
  for (Eigen::Vector3i& t : topology.triangles) {
    for (int k = 0; k < 3; ++k) t[k] = tracked_from_fine[t[k]];
  }
  topology.vertex_count = static_cast<int>(mesh.skin_vertices.size());
  topology.uvs = fine_uvs;

  for (const int side : {kLeft, kRight}) {
    EyePatch& patch = mesh.patches[side];
    for (const int v : RefineRow(atlas.lids[side].upper, skin)) patch.upper.push_back(tracked_from_fine.at(v));
    for (const int v : RefineRow(atlas.lids[side].lower, skin)) patch.lower.push_back(tracked_from_fine.at(v));
    const int columns = static_cast<int>(patch.upper.size()) - 1;
    patch.inner.resize(columns - 1);
    for (auto& column : patch.inner) {
      for (int& v : column) v = topology.vertex_count++;
    }
    // Corners of the grid as vertex and texture coordinate. On the lids the latter are the skin's own, so that there is
    // no seam.
    const auto& coarse = atlas.patches[side];
    const auto coarse_uv = [&](int c, int r) -> Eigen::Vector2f {
      const int c0 = c / 2, c1 = (c + 1) / 2, r0 = r / 2, r1 = (r + 1) / 2;
      return (atlas.uvs[coarse[c0][r0]] + atlas.uvs[coarse[c0][r1]] + atlas.uvs[coarse[c1][r0]] +
              atlas.uvs[coarse[c1][r1]]) /
             4;
    };
    std::map<std::pair<int, int>, Corner> grid;
    std::map<int, int> lid_uv;
    for (size_t t = 0; t < topology.triangles.size(); ++t) {
      for (int k = 0; k < 3; ++k) lid_uv[topology.triangles[t][k]] = topology.triangle_uvs[t][k];
    }
    const auto corner = [&](int c, int r) {
      if (r == 0) return Corner{patch.upper[c], lid_uv.at(patch.upper[c])};
      if (r == kFinePatchRows || c == 0 || c == columns) return Corner{patch.lower[c], lid_uv.at(patch.lower[c])};
      const auto [it, added] =
          grid.try_emplace({c, r}, Corner{patch.inner[c - 1][r - 1], static_cast<int>(topology.uvs.size())});
      if (added) topology.uvs.push_back(coarse_uv(c, r));
      return it->second;
    };
    const auto append = [&](const Corner& a, const Corner& b, const Corner& c) {
      if (a.vertex == b.vertex || b.vertex == c.vertex || c.vertex == a.vertex) return;
      topology.triangles.emplace_back(a.vertex, b.vertex, c.vertex);
      topology.triangle_uvs.emplace_back(a.uv, b.uv, c.uv);
    };
    // Columns run to the subject's left and rows down: seen from outside, down and then left is counter-clockwise.
    for (int c = 0; c < columns; ++c) {
      for (int r = 0; r < kFinePatchRows; ++r) {
        append(corner(c, r), corner(c, r + 1), corner(c + 1, r + 1));
        append(corner(c, r), corner(c + 1, r + 1), corner(c + 1, r));
      }
    }
  }

  // Texture coordinates that no triangle uses are dropped.
  std::vector<int> new_index(topology.uvs.size(), -1);
  std::vector<Eigen::Vector2f> used;
  for (Eigen::Vector3i& t : topology.triangle_uvs) {
    for (int k = 0; k < 3; ++k) {
      int& index = new_index[t[k]];
      if (index < 0) {
        index = static_cast<int>(used.size());
        used.push_back(topology.uvs[t[k]]);
      }
      t[k] = index;
    }
  }
  topology.uvs = std::move(used);
  topology.Check("tracked mesh");
  return mesh;
}

Vertices TrackedMesh::Positions(const Vertices& fine_skin, const std::array<EyeFit, 2>& eyes) const {
  Vertices result(topology.vertex_count, 3);
  for (size_t i = 0; i < skin_vertices.size(); ++i) {
    result.row(static_cast<Eigen::Index>(i)) = fine_skin.row(skin_vertices[i]);
  }
  for (const int side : {kLeft, kRight}) {
    const EyePatch& patch = patches[side];
    const Eigen::RowVector3f centre = eyes[side].centre.transpose();
    const float least = eyes[side].radius + kPatchClearance;
    for (size_t c = 0; c < patch.inner.size(); ++c) {
      const Eigen::RowVector3f upper = result.row(patch.upper[c + 1]) - centre;
      const Eigen::RowVector3f lower = result.row(patch.lower[c + 1]) - centre;
      for (int r = 1; r < kFinePatchRows; ++r) {
        const float t = static_cast<float>(r) / kFinePatchRows;
        const Eigen::RowVector3f direction = (upper + (lower - upper) * t).normalized();
        const float radius = std::max(least, upper.norm() + (lower.norm() - upper.norm()) * t);
        result.row(patch.inner[c][r - 1]) = centre + radius * direction;
      }
    }
  }
  return result;
}

}  // namespace likeness
