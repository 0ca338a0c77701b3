#include "likeness/simulate/glb/closed_surface.h"

#include <meshoptimizer.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/log.h"
#include "likeness/simulate/glb/inside.h"
#include "likeness/simulate/glb/triangles.h"

namespace likeness {
namespace {

using Eigen::RowVector3f;
using Eigen::Vector3f;
using Eigen::Vector3i;

// Triangles of the model's skin, vertices by the model's numbers.
struct Skin {
  std::vector<Vector3i> triangles;
  std::vector<std::pair<int, int>> sources;

  void Keep(const std::vector<bool>& wanted) {
    size_t kept = 0;
    for (size_t t = 0; t < triangles.size(); ++t) {
      if (!wanted[t]) continue;
      triangles[kept] = triangles[t];
      sources[kept++] = sources[t];
    }
    triangles.resize(kept);
    sources.resize(kept);
  }
};

// The piece of skin in which most vertices move when the eyes blink and the jaw opens.
Skin FindFace(const std::filesystem::path& path, const HeadModel& model) {
  Skin skin;
  for (size_t s = 0; s < model.surfaces.size(); ++s) {
    if (model.surfaces[s].kind != PartKind::kSkin) continue;
    for (size_t t = 0; t < model.surfaces[s].triangles.size(); ++t) {
      skin.triangles.push_back(model.surfaces[s].triangles[t]);
      skin.sources.emplace_back(s, t);
    }
  }
  std::array<float, kExpressionCount> all;
  all.fill(1);
  const Vertices moved = model.shapes.Pose(all) - model.shapes.rest();
  const std::vector<int> pieces = ConnectedPieces(skin.triangles, static_cast<int>(moved.rows()));
  std::map<int, int> votes;
  for (size_t t = 0; t < pieces.size(); ++t) {
    for (const int v : skin.triangles[t]) votes[pieces[t]] += moved.row(v).squaredNorm() > 0.01f ? 1 : 0;
  }
  const auto most =
      std::max_element(votes.begin(), votes.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == votes.end() || most->second == 0) {
    throw FileError(path, "has expressions, but none moves its skin: no face was found");
  }
  std::vector<bool> wanted;
  for (const int piece : pieces) wanted.push_back(piece == most->first);
  skin.Keep(wanted);
  return skin;
}

void KeepManifold(Skin* skin) {
  std::vector<bool> wanted(skin->triangles.size(), false);
  for (const int t : ManifoldSubset(skin->triangles)) wanted[t] = true;
  skin->Keep(wanted);
}

void Simplify(const std::filesystem::path& path, const Vertices& rest, int most_vertices, Skin* skin) {
  const auto count = static_cast<int>(VerticesOf(skin->triangles).size());
  if (count <= most_vertices) return;
  std::vector<unsigned int> indices;
  for (const Vector3i& t : skin->triangles) {
    for (const int v : t) indices.push_back(static_cast<unsigned int>(v));
  }
  const auto wanted = static_cast<size_t>(static_cast<double>(indices.size()) * most_vertices / count) / 3 * 3;
  std::vector<unsigned int> fewer(indices.size());
  fewer.resize(meshopt_simplify(fewer.data(), indices.data(), indices.size(), rest.data(),
                                static_cast<size_t>(rest.rows()), 3 * sizeof(float), wanted, 0.05f));
  // A triangle's own texture coordinates are lost with it.
  skin->triangles.clear();
  skin->sources.clear();
  for (size_t i = 0; i < fewer.size(); i += 3) {
    skin->triangles.emplace_back(static_cast<int>(fewer[i]), static_cast<int>(fewer[i + 1]),
                                 static_cast<int>(fewer[i + 2]));
    skin->sources.emplace_back(-1, -1);
  }
  LogInfo("{}: tracked skin simplified from {} to {} vertices", path.string(), count,
          VerticesOf(skin->triangles).size());
}

Vector3f MeanOf(const Vertices& positions, const std::vector<int>& vertices) {
  RowVector3f sum = RowVector3f::Zero();
  for (const int v : vertices) sum += positions.row(v);
  return sum.transpose() / static_cast<float>(vertices.size());
}

// Whether a border runs around the front of an eye.
bool IsAroundEye(const Vertices& rest, const std::vector<int>& loop, const ModelEye& eye) {
  const Vector3f from_eye = MeanOf(rest, loop) - eye.centre;
  return loop.size() >= 6 && from_eye.head<2>().norm() < 0.8f * eye.radius && from_eye.z() > -0.5f * eye.radius &&
         from_eye.z() < 2.5f * eye.radius;
}

bool IsAroundAnyEye(const HeadModel& model, const std::vector<int>& loop) {
  return std::any_of(model.eyes.begin(), model.eyes.end(),
                     [&](const ModelEye& eye) { return IsAroundEye(model.shapes.rest(), loop, eye); });
}

// The border at the neck: the one with most of the cut, else the lowest. -1 when all borders are around eyes.
int FindNeck(const HeadModel& model, const std::vector<std::vector<int>>& loops) {
  int best = -1;
  std::pair<int64_t, float> best_score;
  for (size_t i = 0; i < loops.size(); ++i) {
    if (IsAroundAnyEye(model, loops[i])) continue;
    const auto cut = std::count_if(loops[i].begin(), loops[i].end(), [&](int v) { return model.on_cut[v]; });
    const std::pair<int64_t, float> score(cut, -MeanOf(model.shapes.rest(), loops[i]).y());
    if (best < 0 || score > best_score) best = static_cast<int>(i), best_score = score;
  }
  return best;
}

// A closed skin is opened at its lowest triangle.
void OpenAtBottom(const Vertices& rest, Skin* skin) {
  std::vector<bool> wanted(skin->triangles.size(), true);
  const auto height = [&](const Vector3i& t) { return rest(t[0], 1) + rest(t[1], 1) + rest(t[2], 1); };
  const auto lowest = std::min_element(skin->triangles.begin(), skin->triangles.end(),
                                       [&](const Vector3i& a, const Vector3i& b) { return height(a) < height(b); });
  wanted[static_cast<size_t>(lowest - skin->triangles.begin())] = false;
  skin->Keep(wanted);
}

// Lengths along a row of vertices, from 0 to 1.
std::vector<float> Along(const Vertices& positions, const std::vector<int>& row) {
  std::vector<float> length = {0};
  for (size_t i = 1; i < row.size(); ++i) {
    length.push_back(length.back() + (positions.row(row[i]) - positions.row(row[i - 1])).norm());
  }
  for (float& l : length) l = length.back() > 0 ? l / length.back() : 0;
  length.back() = 1;
  return length;
}

BorderPoint PointAt(const std::vector<int>& row, const std::vector<float>& along, float s) {
  size_t i = 1;
  while (i + 1 < row.size() && along[i] < s) ++i;
  const float span = along[i] - along[i - 1];
  return {row[i - 1], row[i], span > 0 ? std::clamp((s - along[i - 1]) / span, 0.0f, 1.0f) : 0};
}

// Triangles between an upper and a lower row that share both ends, x growing.
void AddStrip(const std::vector<int>& upper, const std::vector<float>& upper_at, const std::vector<int>& lower,
              const std::vector<float>& lower_at, std::vector<Vector3i>* triangles) {
  size_t i = 0, j = 0;
  while (i + 1 < upper.size() || j + 1 < lower.size()) {
    const bool go_above = j + 1 == lower.size() || (i + 1 < upper.size() && upper_at[i + 1] <= lower_at[j + 1]);
    const Vector3i t =
        go_above ? Vector3i(upper[i + 1], upper[i], lower[j]) : Vector3i(upper[i], lower[j], lower[j + 1]);
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles->push_back(t);
    go_above ? ++i : ++j;
  }
}

// Closes an opening whose border is `loop`, by tracked numbers.
LidPatch CloseLids(const Vertices& rest, const std::vector<int>& loop, ClosedSurface* surface) {
  LidPatch patch;
  patch.closed = true;
  // The corners are the two vertices that are farthest from each other.
  size_t a = 0, b = 1;
  float widest = -1;
  for (size_t i = 0; i < loop.size(); ++i) {
    for (size_t j = i + 1; j < loop.size(); ++j) {
      const float width = (rest.row(loop[i]) - rest.row(loop[j])).norm();
      if (width > widest) widest = width, a = i, b = j;
    }
  }
  if (rest(loop[a], 0) > rest(loop[b], 0)) std::swap(a, b);
  // With the surface on its left the border runs over the top from the smaller to the larger x.
  for (size_t i = a;; i = (i + 1) % loop.size()) {
    patch.upper.push_back(loop[i]);
    if (i == b) break;
  }
  for (size_t i = b;; i = (i + 1) % loop.size()) {
    patch.lower.insert(patch.lower.begin(), loop[i]);
    if (i == a) break;
  }
  const std::vector<float> upper_at = Along(rest, patch.upper), lower_at = Along(rest, patch.lower);
  const size_t columns = std::max(patch.upper.size(), patch.lower.size()) - 1;
  std::vector<float> column_at = {0};
  patch.first = surface->vertex_count;
  for (size_t c = 1; c < columns; ++c) {
    column_at.push_back(static_cast<float>(c) / static_cast<float>(columns));
    patch.top.push_back(PointAt(patch.upper, upper_at, column_at.back()));
    patch.bottom.push_back(PointAt(patch.lower, lower_at, column_at.back()));
  }
  column_at.push_back(1);
  surface->vertex_count += static_cast<int>(columns - 1) * (kLidRows - 1);
  std::vector<int> above = patch.upper;
  std::vector<float> above_at = upper_at;
  for (int r = 1; r < kLidRows; ++r) {
    std::vector<int> row = {patch.upper.front()};
    for (size_t c = 0; c + 1 < columns; ++c) row.push_back(patch.first + static_cast<int>(c) * (kLidRows - 1) + r - 1);
    row.push_back(patch.upper.back());
    AddStrip(above, above_at, row, column_at, &surface->triangles);
    above = row;
    above_at = column_at;
  }
  AddStrip(above, above_at, patch.lower, lower_at, &surface->triangles);
  return patch;
}

// The direction at `t` of the way from one to another over the front of an eye, at even angles.
RowVector3f Between(RowVector3f from, RowVector3f to, float t) {
  // Borders beside the eye's centre would else be joined behind it.
  constexpr float kForward = 0.1f;
  for (RowVector3f* direction : {&from, &to}) {
    direction->z() = std::max(direction->z(), kForward * direction->norm());
    direction->stableNormalize();
  }
  const float angle = std::acos(std::clamp(from.dot(to), -1.0f, 1.0f));
  if (angle < 1e-3f) return from;
  return (std::sin((1 - t) * angle) * from + std::sin(t * angle) * to).stableNormalized();
}

}  // namespace

ClosedSurface CloseSurface(const std::filesystem::path& path_for_errors, const HeadModel& model, int most_vertices) {
  const Vertices& rest = model.shapes.rest();
  Skin skin = FindFace(path_for_errors, model);
  Simplify(path_for_errors, rest, most_vertices, &skin);
  KeepManifold(&skin);
  std::vector<std::vector<int>> loops = BorderLoops(skin.triangles);
  for (const ModelEye& eye : model.eyes) {
    const bool open = std::any_of(loops.begin(), loops.end(),
                                  [&](const std::vector<int>& loop) { return IsAroundEye(rest, loop, eye); });
    if (open || !eye.has_ball) continue;
    skin.Keep(SeenInFrontOfEye(rest, skin.triangles, eye));
  }
  loops = BorderLoops(skin.triangles);
  if (FindNeck(model, loops) < 0) {
    OpenAtBottom(rest, &skin);
    loops = BorderLoops(skin.triangles);
  }

  ClosedSurface surface;
  surface.model_vertices = VerticesOf(skin.triangles);
  std::map<int, int> tracked;
  for (size_t i = 0; i < surface.model_vertices.size(); ++i) tracked[surface.model_vertices[i]] = static_cast<int>(i);
  surface.vertex_count = static_cast<int>(surface.model_vertices.size());
  for (const Vector3i& t : skin.triangles) surface.triangles.emplace_back(tracked[t[0]], tracked[t[1]], tracked[t[2]]);
  surface.sources = std::move(skin.sources);
  Vertices tracked_rest(surface.vertex_count, 3);
  for (int i = 0; i < surface.vertex_count; ++i) tracked_rest.row(i) = rest.row(surface.model_vertices[i]);

  const int neck = FindNeck(model, loops);
  for (size_t i = 0; i < loops.size(); ++i) {
    std::vector<int> loop;
    for (const int v : loops[i]) loop.push_back(tracked[v]);
    if (static_cast<int>(i) == neck) {
      surface.neck = loop;
      continue;
    }
    const auto eye = std::find_if(model.eyes.begin(), model.eyes.end(), [&](const ModelEye& candidate) {
      return IsAroundEye(rest, loops[i], candidate) && !surface.lids[&candidate - model.eyes.data()].closed;
    });
    if (eye != model.eyes.end()) {
      surface.lids[eye - model.eyes.begin()] = CloseLids(tracked_rest, loop, &surface);
      continue;
    }
    if (loop.size() < 3) continue;
    HolePatch hole;
    hole.border = loop;
    hole.middle = surface.vertex_count++;
    for (size_t k = 0; k < loop.size(); ++k) {
      surface.triangles.emplace_back(loop[(k + 1) % loop.size()], loop[k], hole.middle);
    }
    surface.holes.push_back(std::move(hole));
  }
  surface.regions.assign(surface.triangles.size(), Region::kOutside);
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    const int last = surface.triangles[t].maxCoeff();
    for (const LidPatch& lid : surface.lids) {
      const int end = lid.first + static_cast<int>(lid.top.size()) * (kLidRows - 1);
      if (lid.closed && last >= lid.first && last < end) surface.regions[t] = Region::kPatch;
    }
  }
  for (const int t : FindMouth(surface.Positions(rest, model.eyes), surface.triangles)) {
    if (surface.regions[t] == Region::kOutside) surface.regions[t] = Region::kMouth;
  }
  return surface;
}

Vertices ClosedSurface::Positions(const Vertices& model, const std::array<ModelEye, 2>& eyes) const {
  Vertices result(vertex_count, 3);
  for (size_t i = 0; i < model_vertices.size(); ++i) {
    result.row(static_cast<Eigen::Index>(i)) = model.row(model_vertices[i]);
  }
  for (const HolePatch& hole : holes) result.row(hole.middle) = MeanOf(result, hole.border);
  for (const int side : {kLeft, kRight}) {
    const LidPatch& lid = lids[side];
    const RowVector3f centre = eyes[side].centre.transpose();
    const float least = eyes[side].has_ball ? eyes[side].radius + kLidClearanceMm : 0;
    const auto at = [&](const BorderPoint& p) -> RowVector3f {
      return result.row(p.a) + p.t * (result.row(p.b) - result.row(p.a)) - centre;
    };
    for (size_t c = 0; c < lid.top.size(); ++c) {
      const RowVector3f upper = at(lid.top[c]), lower = at(lid.bottom[c]);
      for (int r = 1; r < kLidRows; ++r) {
        const float t = static_cast<float>(r) / kLidRows;
        const RowVector3f direction = Between(upper, lower, t);
        const float distance = std::max(least, upper.norm() + (lower.norm() - upper.norm()) * t);
        result.row(lid.first + static_cast<int>(c) * (kLidRows - 1) + r - 1) = centre + distance * direction;
      }
    }
  }
  return result;
}

}  // namespace likeness
