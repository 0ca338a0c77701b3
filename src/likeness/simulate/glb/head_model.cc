#include "likeness/simulate/glb/head_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "likeness/base/error.h"
#include "likeness/base/log.h"

namespace likeness {
namespace {

using Eigen::Vector3f;

constexpr float kEyesApartMm = 64;  // of adults

// Scales to millimetres whatever unit the file has, as far as it is a power of ten off.
float FindScale(const std::filesystem::path& path, const std::array<ModelEye, 2>& eyes) {
  const float apart = (eyes[kLeft].centre - eyes[kRight].centre).norm();
  for (const float scale : {1.0f, 0.1f, 0.01f, 0.001f, 10.0f, 100.0f, 1000.0f}) {
    if (apart * scale < 40 || apart * scale > 95) continue;
    if (scale != 1) LogWarning("{}: its unit is not the metre; scaled by {}", path.string(), scale);
    return scale;
  }
  throw FileError(path, fmt::format("its eyes are {} m apart; expected a head in metres", apart / kMmPerUnit));
}

// How far a point is above the cut: a plane below the neck that rises like a funnel over the shoulders. Hair hangs down
// to the plane.
float AboveCut(const Vector3f& p, PartKind kind, float scale) {
  constexpr float kNeckRadiusMm = 70, kSlope = 1.1f;
  const float plane = p.y() + scale * kCutBelowEyesMm;
  if (kind == PartKind::kHair) return plane;
  // In front of the neck only the width counts: chins and bellies stand out.
  const float aside = std::hypot(p.x(), std::min(p.z() + 20 * scale, 0.0f)) - kNeckRadiusMm * scale;
  return plane - kSlope * std::max(aside, 0.0f);
}

// Keeps what is above the cut. New vertices on edges are blends of their ends. Returns the blend of the old vertices
// that makes each new one.
//   scale  of the head, 1 for an adult
Stencil CutBelow(const Vertices& positions, float scale, std::vector<ModelSurface>* surfaces,
                 std::vector<bool>* on_cut) {
  std::vector<Eigen::Triplet<float>> blends;
  std::map<std::pair<int, int>, int> index;  // (vertex, vertex) or the two ends of a cut edge
  const auto add = [&](int a, int b, float t) {
    const auto [it, added] = index.try_emplace(std::minmax(a, b), static_cast<int>(on_cut->size()));
    if (!added) return it->second;
    if (t < 1) blends.emplace_back(it->second, a, 1 - t);
    if (t > 0) blends.emplace_back(it->second, b, t);
    on_cut->push_back(a != b);
    return it->second;
  };
  for (ModelSurface& surface : *surfaces) {
    const auto height = [&](int v) { return AboveCut(positions.row(v).transpose(), surface.kind, scale); };
    std::vector<Eigen::Vector3i> triangles, triangle_uvs;
    std::map<std::pair<int, int>, int> uv_index;
    const auto cut_uv = [&](int a, int b, float t) {
      const auto [it, added] = uv_index.try_emplace(std::minmax(a, b), static_cast<int>(surface.uvs.size()));
      if (added) surface.uvs.push_back(surface.uvs[a] + t * (surface.uvs[b] - surface.uvs[a]));
      return it->second;
    };
    for (size_t i = 0; i < surface.triangles.size(); ++i) {
      std::vector<std::pair<int, int>> outline;  // vertex, uv
      for (int k = 0; k < 3; ++k) {
        const int a = surface.triangles[i][k], b = surface.triangles[i][(k + 1) % 3];
        const int uv_a = surface.triangle_uvs[i][k], uv_b = surface.triangle_uvs[i][(k + 1) % 3];
        if (height(a) >= 0) outline.emplace_back(add(a, a, 0), uv_a);
        if ((height(a) >= 0) == (height(b) >= 0)) continue;
        const float t = height(a) / (height(a) - height(b));
        outline.emplace_back(add(a, b, t), cut_uv(uv_a, uv_b, t));
      }
      for (size_t k = 2; k < outline.size(); ++k) {
        triangles.emplace_back(outline[0].first, outline[k - 1].first, outline[k].first);
        triangle_uvs.emplace_back(outline[0].second, outline[k - 1].second, outline[k].second);
      }
    }
    surface.triangles = std::move(triangles);
    surface.triangle_uvs = std::move(triangle_uvs);
  }
  std::erase_if(*surfaces, [](const ModelSurface& surface) { return surface.triangles.empty(); });
  Stencil stencil(static_cast<Eigen::Index>(on_cut->size()), positions.rows());
  stencil.setFromTriplets(blends.begin(), blends.end());
  return stencil;
}

std::vector<std::string> MissingExpressions(const Gathered& all, const std::array<ModelEye, 2>& eyes) {
  std::vector<std::string> missing;
  for (int k = 0; k < kExpressionCount; ++k) {
    if (!all.shapes[k].vertices.empty()) continue;
    if (ExpressionNames()[k].starts_with("eyeLook") && eyes[kLeft].has_ball && eyes[kRight].has_ball) continue;
    missing.push_back(ExpressionNames()[k]);
  }
  return missing;
}

}  // namespace

HeadModel BuildHeadModel(const std::filesystem::path& path_for_errors, const GltfScene& scene, const ShapeMap& map) {
  if (scene.parts.empty()) throw FileError(path_for_errors, "shows no triangles");
  Gathered all = GatherParts(scene, map);
  const bool any =
      std::any_of(all.shapes.begin(), all.shapes.end(), [](const Target& s) { return !s.vertices.empty(); });
  if (!any) {
    size_t targets = 0;
    for (const GltfPart& part : scene.parts) targets += part.morphs.size();
    throw FileError(path_for_errors,
                    targets == 0 ? "has no morph targets, so it cannot be animated"
                                 : fmt::format("has {} morph targets, but none is named like an ARKit expression; name "
                                               "them with --shape-map FILE.json",
                                               targets));
  }
  JoinSeams(&all);
  const bool named = std::any_of(all.surfaces.begin(), all.surfaces.end(),
                                 [](const ModelSurface& s) { return s.kind == PartKind::kEye; });
  if (!named) FindUnnamedEyes(&all);

  HeadModel model;
  model.eyes = FindEyes(path_for_errors, all);
  model.missing = MissingExpressions(all, model.eyes);
  const float scale = FindScale(path_for_errors, model.eyes);
  all.positions *= scale;
  for (Target& shape : all.shapes) {
    for (Vector3f& delta : shape.deltas) delta *= scale;
  }
  for (ModelEye& eye : model.eyes) {
    eye.centre *= scale;
    if (eye.has_ball) eye.radius *= scale;
  }
  const Vector3f between = (model.eyes[kLeft].centre + model.eyes[kRight].centre) / 2;
  Eigen::AlignedBox3f skull;
  for (const ModelSurface& surface : all.surfaces) {
    if (surface.kind != PartKind::kSkin) continue;
    for (const int v : VerticesOf(surface.triangles)) {
      const Vector3f p = all.positions.row(v);
      // Above the eyes and the bridge of the nose; raised hands are farther away.
      if (p.y() > between.y() + 15 && (p - between).norm() < 250) skull.extend(p);
    }
  }
  if (skull.isEmpty()) throw FileError(path_for_errors, "has no skin above its eyes: no head was found");
  const Vector3f origin(between.x(), between.y(), skull.center().z());
  all.positions.rowwise() -= origin.transpose();
  for (ModelEye& eye : model.eyes) eye.centre -= origin;

  const float apart = (model.eyes[kLeft].centre - model.eyes[kRight].centre).norm();
  const float size = std::clamp(apart / kEyesApartMm, 0.7f, 1.3f);
  model.is_cut = all.positions.col(1).minCoeff() < -kCutBelowEyesMm * size;
  const Stencil stencil = CutBelow(all.positions, size, &all.surfaces, &model.on_cut);
  model.shapes = LinearShapes(stencil, all.positions, all.shapes);
  model.surfaces = std::move(all.surfaces);
  model.turns.assign(model.on_cut.size(), -1);
  for (const ModelSurface& surface : model.surfaces) {
    if (surface.kind != PartKind::kEye) continue;
    for (const int v : VerticesOf(surface.triangles)) {
      const Side side = model.shapes.rest()(v, 0) > 0 ? kLeft : kRight;
      if (model.eyes[side].has_ball && !model.eyes[side].has_gaze) model.turns[v] = side;
    }
  }
  return model;
}

}  // namespace likeness
