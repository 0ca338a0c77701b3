#include "likeness/simulate/glb/surface_atlas.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <queue>
#include <set>

#include "likeness/base/error.h"
#include "likeness/simulate/glb/own_atlas.h"
#include "likeness/simulate/glb/triangles.h"
#include "likeness/simulate/parametrise.h"

namespace likeness {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using Eigen::Vector3i;

// Texel centres of a 512 texture stay clear of the border, and the two charts are this far apart.
constexpr float kGap = 3.0f / 512;
constexpr float kMouthHeight = 0.17f;
constexpr int kRounds = 24;

float Smooth(float low, float high, float value) {
  const float t = std::clamp((value - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

// Wanted texels a millimetre, relative: more for eyes and lips, less behind the ears and on the neck.
class Density {
 public:
  Density(const HeadModel& model, const Vector3f& mouth) : model_(model), mouth_(mouth) {
    face_ = 0.5f * mouth + 0.25f * (model.eyes[kLeft].centre + model.eyes[kRight].centre);
    apart_ = (model.eyes[kLeft].centre - model.eyes[kRight].centre).norm();
  }
  float operator()(const Vector3f& p) const {
    float density = 1 - 0.68f * Smooth(1.2f * apart_, 2.3f * apart_, (p - face_).norm());
    for (const ModelEye& eye : model_.eyes) {
      density += 0.7f * (1 - Smooth(0.22f * apart_, 0.5f * apart_, (p - eye.centre).norm() - eye.radius));
    }
    return density + 0.5f * (1 - Smooth(0.3f * apart_, 0.6f * apart_, (p - mouth_).norm()));
  }

 private:
  const HeadModel& model_;
  Vector3f mouth_, face_;
  float apart_;
};
constexpr float kPatchDensity = 3.5f;  // eyes change more than any skin

// A part of the surface as a disc: its vertices are numbered anew, some of them twice along a cut.
struct Sheet {
  Disc disc;
  std::vector<int> triangles;  // of the surface
  std::vector<Vector3i> corners;
  std::vector<int> border;  // in order around it, the surface on its left
};

std::vector<Vector3i> Pick(const std::vector<Vector3i>& triangles, const std::vector<int>& which) {
  std::vector<Vector3i> some;
  for (const int t : which) some.push_back(triangles[t]);
  return some;
}

// Whether triangles are one disc: one border and Euler's number one.
bool IsDisc(const std::vector<Vector3i>& triangles, size_t extra_borders) {
  std::set<int> vertices;
  std::set<std::pair<int, int>> edges;
  for (const Vector3i& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      vertices.insert(t[k]);
      edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
    }
  }
  const int64_t euler = static_cast<int64_t>(vertices.size()) - static_cast<int64_t>(edges.size()) +
                        static_cast<int64_t>(triangles.size());
  return BorderLoops(triangles).size() == 1 + extra_borders && euler == 1 - static_cast<int64_t>(extra_borders);
}

// The way along edges from the border at the neck up the back of the head to the crown, where the surface is cut open.
std::vector<int> BackSeam(const std::vector<Vector3i>& triangles, const std::vector<int>& neck, const Vertices& rest) {
  std::map<int, std::set<int>> next;
  for (const Vector3i& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      next[t[k]].insert(t[(k + 1) % 3]);
      next[t[(k + 1) % 3]].insert(t[k]);
    }
  }
  const std::set<int> on_neck(neck.begin(), neck.end());
  int start = neck[0], crown = -1;
  for (const int v : neck) {
    if (rest(v, 2) + std::abs(rest(v, 0)) < rest(start, 2) + std::abs(rest(start, 0))) start = v;
  }
  // The highest point near the middle; a little to the back, where hair is least seen.
  const auto height = [&](int v) { return rest(v, 1) - 0.35f * rest(v, 2) - std::abs(rest(v, 0)); };
  for (const auto& [v, others] : next) {
    if (!on_neck.contains(v) && (crown < 0 || height(v) > height(crown))) crown = v;
  }
  // Dijkstra, dearer away from the middle.
  std::map<int, float> cost = {{start, 0.0f}};
  std::map<int, int> before;
  std::priority_queue<std::pair<float, int>, std::vector<std::pair<float, int>>, std::greater<>> open;
  open.emplace(0, start);
  while (!open.empty() && open.top().second != crown) {
    const auto [so_far, v] = open.top();
    open.pop();
    if (so_far > cost[v]) continue;
    for (const int n : next[v]) {
      if (on_neck.contains(n)) continue;
      const float aside = std::abs(rest(n, 0)) / 15;
      const float in_front = std::max(0.0f, rest(n, 2)) / 15;
      const float reached = so_far + (rest.row(n) - rest.row(v)).norm() * (1 + aside * aside + in_front * in_front);
      const auto [it, added] = cost.try_emplace(n, reached);
      if (!added && it->second <= reached) continue;
      it->second = reached;
      before[n] = v;
      open.emplace(reached, n);
    }
  }
  if (!before.contains(crown)) return {};
  std::vector<int> seam = {crown};
  while (seam.back() != start) seam.push_back(before[seam.back()]);
  std::reverse(seam.begin(), seam.end());
  return seam;
}

// The triangles around each vertex of the seam but its last that lie on the left of it, going up.
std::set<std::pair<int, int>> LeftOfSeam(const std::vector<Vector3i>& triangles, const std::vector<int>& seam) {
  const EdgeMap edges(triangles);
  std::set<std::pair<int, int>> left;  // vertex, triangle
  for (size_t i = 0; i + 1 < seam.size(); ++i) {
    const int v = seam[i];
    int other = seam[i + 1];
    // Each step turns counter-clockwise around v: the triangle on the left of v -> other has the next edge from v.
    for (int t = edges.Left(v, other); t >= 0; t = edges.Left(v, other)) {
      left.emplace(v, t);
      const Vector3i& q = triangles[t];
      const int k = q[0] == v ? 0 : q[1] == v ? 1 : 2;
      other = q[(k + 2) % 3];
      if (i > 0 && other == seam[i - 1]) break;
      if (left.contains({v, edges.Left(v, other)})) break;
    }
  }
  return left;
}

// Spreads the vertices of a row over a straight side by wanted length; the last one is left to the next side.
template <typename Length>
void AddSide(const std::vector<int>& row, const Vector2f& from, const Vector2f& to, const Length& length, Disc* disc) {
  std::vector<float> along = {0};
  for (size_t i = 1; i < row.size(); ++i) along.push_back(along.back() + length(row[i - 1], row[i]));
  for (size_t i = 0; i + 1 < row.size(); ++i) {
    const float t = along.back() > 0 ? along[i] / along.back() : static_cast<float>(i) / static_cast<float>(row.size());
    disc->border.emplace_back(row[i], from + (to - from) * t);
  }
}

// Head, cut open at the back, on [0, 1] x [bottom, 1].
std::optional<Sheet> SpreadHead(const ClosedSurface& surface, const std::vector<int>& which, const Vertices& rest,
                                const Density& density, float bottom_edge) {
  const std::vector<Vector3i> triangles = Pick(surface.triangles, which);
  const std::vector<int> seam = BackSeam(triangles, surface.neck, rest);
  if (seam.size() < 4) return std::nullopt;
  const auto left = LeftOfSeam(triangles, seam);
  const std::set<int> doubled(seam.begin(), seam.end() - 1);
  Sheet sheet;
  sheet.triangles = which;
  std::map<std::pair<int, bool>, int> index;
  const auto at = [&](int v, bool on_left) {
    const auto [it, added] = index.try_emplace({v, on_left}, static_cast<int>(sheet.disc.positions.size()));
    if (added) sheet.disc.positions.emplace_back(rest.row(v));
    return it->second;
  };
  for (size_t t = 0; t < triangles.size(); ++t) {
    Vector3i corners;
    Vector3f middle = Vector3f::Zero();
    for (int k = 0; k < 3; ++k) {
      const int v = triangles[t][k];
      corners[k] = at(v, doubled.contains(v) && left.contains({v, static_cast<int>(t)}));
      middle += rest.row(v).transpose() / 3;
    }
    sheet.corners.push_back(corners);
    sheet.disc.faces.push_back({corners[0], corners[1], corners[2]});
    sheet.disc.density.push_back(surface.regions[which[t]] == Region::kPatch ? kPatchDensity : density(middle));
  }
  // Lips: a lid of no texels over the mouth.
  for (const std::vector<int>& loop : BorderLoops(triangles)) {
    if (std::find(surface.neck.begin(), surface.neck.end(), loop[0]) != surface.neck.end()) continue;
    const int middle = static_cast<int>(sheet.disc.positions.size());
    Vector3f sum = Vector3f::Zero();
    for (const int v : loop) sum += rest.row(v).transpose() / static_cast<float>(loop.size());
    sheet.disc.positions.push_back(sum);
    for (size_t i = 0; i < loop.size(); ++i) {
      sheet.disc.faces.push_back({at(loop[(i + 1) % loop.size()], false), at(loop[i], false), middle});
      sheet.disc.density.push_back(0);
    }
  }
  // The neck below, over the subject's right first; the border runs with the surface on its left.
  const auto start = std::find(surface.neck.begin(), surface.neck.end(), seam[0]);
  if (start == surface.neck.end()) return std::nullopt;
  std::vector<int> ring(start, surface.neck.end());
  ring.insert(ring.end(), surface.neck.begin(), start);
  std::vector<int> bottom_row;
  for (size_t i = 0; i < ring.size(); ++i) bottom_row.push_back(at(ring[i], false));
  bottom_row.push_back(at(ring[0], true));
  const auto length = [&](int a, int b) {
    const Vector3f& p = sheet.disc.positions[a];
    const Vector3f& q = sheet.disc.positions[b];
    return (q - p).norm() * density((p + q) / 2);
  };
  // A corner of the atlas at this part of the seam, the crown in the middle of the upper side.
  constexpr float kCorner = 0.6f;
  float whole = 0, so_far = 0;
  for (size_t i = 1; i < seam.size(); ++i) whole += length(at(seam[i - 1], i > 1), at(seam[i], false));
  size_t corner = 1;
  while (corner + 2 < seam.size() &&
         (so_far += length(at(seam[corner - 1], false), at(seam[corner], false))) < kCorner * whole) {
    ++corner;
  }
  const auto part = [&](size_t from, size_t to, bool on_left) {
    std::vector<int> row;
    for (size_t i = from; i <= to; ++i) row.push_back(at(seam[i], on_left && i + 1 < seam.size()));
    return row;
  };
  const auto reversed = [](std::vector<int> row) {
    std::reverse(row.begin(), row.end());
    return row;
  };
  const float low = kGap / 2, high = 1 - kGap / 2, bottom = bottom_edge + kGap / 2;
  const size_t end = seam.size() - 1;
  AddSide(bottom_row, {low, bottom}, {high, bottom}, length, &sheet.disc);
  AddSide(part(0, corner, true), {high, bottom}, {high, high}, length, &sheet.disc);
  AddSide(part(corner, end, true), {high, high}, {0.5f, high}, length, &sheet.disc);
  AddSide(reversed(part(corner, end, false)), {0.5f, high}, {low, high}, length, &sheet.disc);
  AddSide(reversed(part(0, corner, false)), {low, high}, {low, bottom}, length, &sheet.disc);
  return sheet;
}

// The inside of the mouth on [0, 1] x [0, kMouthHeight]: the corners of the mouth at the middle of the sides.
Sheet SpreadMouth(const ClosedSurface& surface, const std::vector<int>& which, const Vertices& rest) {
  Sheet sheet;
  sheet.triangles = which;
  const std::vector<Vector3i> triangles = Pick(surface.triangles, which);
  std::vector<int> loop = BorderLoops(triangles)[0];
  float front = -1e9f, back = 1e9f;
  for (const Vector3i& t : triangles) {
    for (const int v : t) front = std::max(front, rest(v, 2)), back = std::min(back, rest(v, 2));
  }
  std::map<int, int> index;
  for (const Vector3i& t : triangles) {
    Vector3i corners;
    float depth = 0;
    for (int k = 0; k < 3; ++k) {
      const auto [it, added] = index.try_emplace(t[k], static_cast<int>(sheet.disc.positions.size()));
      if (added) sheet.disc.positions.emplace_back(rest.row(t[k]));
      corners[k] = it->second;
      depth += (front - rest(t[k], 2)) / (3 * std::max(front - back, 1.0f));
    }
    sheet.corners.push_back(corners);
    sheet.disc.faces.push_back({corners[0], corners[1], corners[2]});
    sheet.disc.density.push_back(1 - 0.75f * Smooth(0.2f, 0.7f, depth));
  }
  // Which way is up is seen from the front of the inside: the loop runs counter-clockwise around the chart.
  const auto smaller_x = [&](int a, int b) { return rest(a, 0) < rest(b, 0); };
  std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end(), smaller_x), loop.end());
  const auto turn = static_cast<size_t>(std::max_element(loop.begin(), loop.end(), smaller_x) - loop.begin());
  loop.push_back(loop[0]);
  const float low = kGap / 2, high = 1 - kGap / 2, top = kMouthHeight - kGap / 2, half = (low + top) / 2;
  // A path of straight pieces from corner to corner of the mouth.
  const auto spread = [&](size_t from, size_t to, const std::vector<Vector2f>& path) {
    std::vector<float> along = {0}, path_along = {0};
    for (size_t i = from + 1; i <= to; ++i) {
      along.push_back(along.back() + (rest.row(loop[i]) - rest.row(loop[i - 1])).norm());
    }
    for (size_t i = 1; i < path.size(); ++i) path_along.push_back(path_along.back() + (path[i] - path[i - 1]).norm());
    for (size_t i = from; i < to; ++i) {
      const float s = along[i - from] / along.back() * path_along.back();
      size_t piece = 1;
      while (piece + 1 < path.size() && path_along[piece] < s) ++piece;
      const float t = (s - path_along[piece - 1]) / (path_along[piece] - path_along[piece - 1]);
      sheet.disc.border.emplace_back(index.at(loop[i]), path[piece - 1] + t * (path[piece] - path[piece - 1]));
    }
  };
  // The lower lip comes first when the loop runs that way, so that it lies below.
  spread(0, turn, {{low, half}, {low, low}, {high, low}, {high, half}});
  spread(turn, loop.size() - 1, {{high, half}, {high, top}, {low, top}, {low, half}});
  return sheet;
}

float FillOf(const SurfaceAtlas& atlas, const ClosedSurface& surface) {
  constexpr int kSize = 512;
  const TexelMap map = MapTexels({surface.vertex_count, atlas.uvs, surface.triangles, atlas.triangle_uvs}, kSize);
  const auto covered = std::count_if(map.texels.begin(), map.texels.end(),
                                     [](const TexelMap::Texel& texel) { return texel.triangle >= 0; });
  return static_cast<float>(covered) / (kSize * kSize);
}

void Append(const Sheet& sheet, SurfaceAtlas* atlas) {
  const int first = static_cast<int>(atlas->uvs.size());
  const std::vector<Vector2f> uvs = MapDiscToRectangle(sheet.disc, kRounds);
  atlas->uvs.insert(atlas->uvs.end(), uvs.begin(), uvs.end());
  for (size_t i = 0; i < sheet.triangles.size(); ++i) {
    atlas->triangle_uvs[sheet.triangles[i]] = sheet.corners[i].array() + first;
  }
}

}  // namespace

SurfaceAtlas MakeSurfaceAtlas(const std::filesystem::path& path_for_errors, const ClosedSurface& surface,
                              const Vertices& rest, const HeadModel& model) {
  SurfaceAtlas atlas;
  if (const auto own = OwnAtlas(surface, rest, model)) {
    atlas.own_fill = own->fill;
    if (own->fill >= kLeastOwnFill) {
      atlas.uvs = own->uvs;
      atlas.triangle_uvs = own->triangle_uvs;
      atlas.is_own = true;
      atlas.fill = FillOf(atlas, surface);
      return atlas;
    }
  }
  std::vector<int> outside, mouth, all;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    (surface.regions[t] == Region::kMouth ? mouth : outside).push_back(static_cast<int>(t));
    all.push_back(static_cast<int>(t));
  }
  const bool parted =
      !mouth.empty() && IsDisc(Pick(surface.triangles, mouth), 0) && IsDisc(Pick(surface.triangles, outside), 1);
  if (!parted && !IsDisc(surface.triangles, 0)) {
    throw FileError(
        path_for_errors,
        "its skin has handles or several borders, so that no atlas can be made for it; mend the mesh, or give "
        "it texture coordinates that fill the texture without overlap");
  }
  Vector3f mouth_centre = (model.eyes[kLeft].centre + model.eyes[kRight].centre) / 2 + Vector3f(0, -65, 25);
  if (parted) {
    const std::vector<int> lips = BorderLoops(Pick(surface.triangles, mouth))[0];
    mouth_centre.setZero();
    for (const int v : lips) mouth_centre += rest.row(v).transpose() / static_cast<float>(lips.size());
  }
  atlas.triangle_uvs.resize(surface.triangles.size());
  const auto head =
      SpreadHead(surface, parted ? outside : all, rest, Density(model, mouth_centre), parted ? kMouthHeight : 0);
  if (!head)
    throw FileError(path_for_errors, "its neck does not reach the back of the head: no atlas can be made for it");
  Append(*head, &atlas);
  if (parted) Append(SpreadMouth(surface, mouth, rest), &atlas);
  atlas.fill = FillOf(atlas, surface);
  return atlas;
}

}  // namespace likeness
