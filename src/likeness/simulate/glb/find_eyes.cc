#include "likeness/simulate/glb/find_eyes.h"

#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "likeness/base/error.h"
#include "likeness/simulate/glb/triangles.h"

namespace likeness {
namespace {

using Eigen::Vector3f;

std::vector<Vector3f> PointsOf(const Vertices& positions, const std::vector<int>& vertices) {
  std::vector<Vector3f> points;
  for (const int v : vertices) points.emplace_back(positions.row(v));
  return points;
}

// Where the lids are that a shape closes: the mean of what it moves, weighted with how far.
std::optional<Vector3f> CentreOfMotion(const Vertices& positions, const Target& shape) {
  Vector3f sum = Vector3f::Zero();
  float weight = 0;
  for (size_t i = 0; i < shape.vertices.size(); ++i) {
    const float w = shape.deltas[i].squaredNorm();
    sum += w * positions.row(shape.vertices[i]).transpose();
    weight += w;
  }
  if (!(weight > 0)) return std::nullopt;
  return sum / weight;
}

}  // namespace

// Parts of skin that are balls, one each side of the face, become eyes.
void FindUnnamedEyes(Gathered* all) {
  struct Ball {
    size_t surface;
    int piece;
    Sphere sphere;
  };
  std::vector<Ball> balls;
  std::vector<std::vector<int>> pieces;
  for (size_t s = 0; s < all->surfaces.size(); ++s) {
    const ModelSurface& surface = all->surfaces[s];
    pieces.push_back(ConnectedPieces(surface.triangles, static_cast<int>(all->positions.rows())));
    if (surface.kind != PartKind::kSkin) continue;
    std::map<int, std::vector<Eigen::Vector3i>> triangles;
    for (size_t t = 0; t < surface.triangles.size(); ++t) triangles[pieces[s][t]].push_back(surface.triangles[t]);
    for (const auto& [piece, of_piece] : triangles) {
      const auto sphere = FitSphere(PointsOf(all->positions, VerticesOf(of_piece)));
      if (sphere && sphere->error < 0.05f * sphere->radius) balls.push_back({s, piece, *sphere});
    }
  }
  // The pair that is best placed: 3 to 8 radii apart, side by side, of one size.
  const Ball* pair[2] = {};
  float best = 0.25f;
  for (const Ball& a : balls) {
    for (const Ball& b : balls) {
      const Vector3f d = b.sphere.centre - a.sphere.centre;
      const float radius = (a.sphere.radius + b.sphere.radius) / 2;
      if (d.x() < 3 * radius || d.x() > 8 * radius) continue;
      const float score =
          (std::abs(d.y()) + std::abs(d.z())) / d.x() + std::abs(a.sphere.radius - b.sphere.radius) / radius;
      if (score < best) best = score, pair[0] = &a, pair[1] = &b;
    }
  }
  if (pair[0] == nullptr) return;
  for (const Ball* ball : pair) {
    ModelSurface& from = all->surfaces[ball->surface];
    ModelSurface eye = from;
    eye.kind = PartKind::kEye;
    eye.triangles.clear(), eye.triangle_uvs.clear();
    std::vector<Eigen::Vector3i> triangles, triangle_uvs;
    for (size_t t = 0; t < from.triangles.size(); ++t) {
      const bool mine = pieces[ball->surface][t] == ball->piece;
      (mine ? eye.triangles : triangles).push_back(from.triangles[t]);
      (mine ? eye.triangle_uvs : triangle_uvs).push_back(from.triangle_uvs[t]);
    }
    // Numbers of pieces stay with their triangles.
    std::erase_if(pieces[ball->surface], [&](int piece) { return piece == ball->piece; });
    from.triangles = std::move(triangles);
    from.triangle_uvs = std::move(triangle_uvs);
    all->surfaces.push_back(std::move(eye));
  }
}

std::array<ModelEye, 2> FindEyes(const std::filesystem::path& path_for_errors, const Gathered& all) {
  std::array<ModelEye, 2> eyes;
  std::vector<int> vertices;
  for (const ModelSurface& surface : all.surfaces) {
    if (surface.kind != PartKind::kEye) continue;
    const std::vector<int> more = VerticesOf(surface.triangles);
    vertices.insert(vertices.end(), more.begin(), more.end());
  }
  std::optional<Vector3f> lids[2];
  lids[kLeft] = CentreOfMotion(all.positions, all.shapes[ExpressionIndex("eyeBlinkLeft")]);
  lids[kRight] = CentreOfMotion(all.positions, all.shapes[ExpressionIndex("eyeBlinkRight")]);
  float middle = 0;
  if (lids[kLeft] && lids[kRight]) {
    if (lids[kLeft]->x() < lids[kRight]->x()) {
      throw FileError(
          path_for_errors,
          "the lids of the left eye are on the right: the head looks along -z or is mirrored; faces in glTF "
          "look along +z");
    }
    middle = (lids[kLeft]->x() + lids[kRight]->x()) / 2;
  } else if (!vertices.empty()) {
    for (const int v : vertices) middle += all.positions(v, 0) / static_cast<float>(vertices.size());
  }
  std::vector<int> balls[2];
  for (const int v : vertices) balls[all.positions(v, 0) > middle ? kLeft : kRight].push_back(v);
  for (const int side : {kLeft, kRight}) {
    ModelEye& eye = eyes[side];
    if (const auto sphere = FitSphere(PointsOf(all.positions, balls[side]))) {
      eye.centre = sphere->centre;
      eye.radius = sphere->radius;
      eye.has_ball = true;
    } else if (lids[side]) {
      eye.centre = *lids[side] - Vector3f(0, 0, eye.radius);
    } else {
      throw FileError(
          path_for_errors,
          "has no face that can be found: neither eyeballs (meshes named eye, or balls) nor shapes that close "
          "both eyes; name them with --shape-map FILE.json");
    }
    const std::set<int> ball(balls[side].begin(), balls[side].end());
    for (int k = 0; k < kExpressionCount; ++k) {
      if (!ExpressionNames()[k].starts_with("eyeLook") ||
          !ExpressionNames()[k].ends_with(side == kLeft ? "Left" : "Right"))
        continue;
      for (const int v : all.shapes[k].vertices) eye.has_gaze |= ball.contains(v);
    }
  }
  return eyes;
}

}  // namespace likeness
