#include "likeness/render/projected_triangle.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <tuple>

namespace likeness {
namespace {

// Triangles are cut where |x| or |y| exceeds this many pixels, so that products of snapped coordinates fit 64 bits.
constexpr double kGuardPx = 1 << 20;

// `from` to `to` is clockwise on the screen, whose y points down, so the inside lies to the right.
Edge MakeEdge(SnappedPoint from, SnappedPoint to) {
  Edge edge;
  edge.a = from.y - to.y;
  edge.b = to.x - from.x;
  edge.c = -(edge.a * from.x + edge.b * from.y);
  const bool top = edge.a == 0 && edge.b > 0, left = edge.a > 0;
  if (!top && !left) edge.c -= 1;
  return edge;
}

// A convex polygon in homogeneous pixel coordinates: a triangle, after up to five cuts.
struct Polygon {
  std::array<Eigen::Vector3d, 8> points;
  int size = 0;

  void Add(const Eigen::Vector3d& point) { points[size++] = point; }
};

// Keeps the part of a polygon where plane . point >= offset (Sutherland and Hodgman 1974).
Polygon Clip(const Polygon& polygon, const Eigen::Vector3d& plane, double offset) {
  Polygon kept;
  for (int i = 0; i < polygon.size; ++i) {
    const Eigen::Vector3d &from = polygon.points[i], &to = polygon.points[(i + 1) % polygon.size];
    const double d0 = plane.dot(from) - offset, d1 = plane.dot(to) - offset;
    if (d0 >= 0) kept.Add(from);
    if ((d0 >= 0) != (d1 >= 0)) {
      // Always from the inner to the outer point, so that neighbours cut a shared edge at the same place.
      const double t = d0 >= 0 ? d0 / (d0 - d1) : d1 / (d1 - d0);
      kept.Add(d0 >= 0 ? Eigen::Vector3d(from + t * (to - from)) : Eigen::Vector3d(to + t * (from - to)));
    }
  }
  return kept;
}

Polygon ClipToGuard(const Polygon& polygon, double near_mm) {
  Polygon kept = Clip(polygon, {0, 0, 1}, near_mm);
  kept = Clip(kept, {1, 0, kGuardPx}, 0);
  kept = Clip(kept, {-1, 0, kGuardPx}, 0);
  kept = Clip(kept, {0, 1, kGuardPx}, 0);
  return Clip(kept, {0, -1, kGuardPx}, 0);
}

// False for points that lie outside of the guard band after all, as those of a triangle of 1e30 mm: cutting it left
// nothing but rounding.
bool CanSnap(const Eigen::Vector3d& p) {
  return p.z() > 0 && std::abs(p.x()) <= 2 * kGuardPx * p.z() && std::abs(p.y()) <= 2 * kGuardPx * p.z();
}

SnappedPoint Snap(const Eigen::Vector3d& p) {
  return {std::llround(p.x() / p.z() * kSubpixels), std::llround(p.y() / p.z() * kSubpixels)};
}

// Pixels with a sample between two snapped coordinates.
std::pair<int, int> PixelRange(int64_t low, int64_t high, int reach, int size) {
  static_assert(kSubpixels == 1 << 8);
  const int64_t begin = (low - kSubpixels / 2 - reach + kSubpixels - 1) >> 8;
  const int64_t end = ((high - kSubpixels / 2 + reach) >> 8) + 1;
  return {static_cast<int>(std::clamp<int64_t>(begin, 0, size)), static_cast<int>(std::clamp<int64_t>(end, 0, size))};
}

// Whether points before the camera lie all to one side of the screen; of a crop's triangles most do.
bool Outside(const Polygon& polygon, const Screen& screen) {
  const auto all = [&](const auto& beyond) {
    return std::all_of(polygon.points.begin(), polygon.points.begin() + polygon.size, beyond);
  };
  return all([](const Eigen::Vector3d& p) { return p.x() < 0; }) ||
         all([](const Eigen::Vector3d& p) { return p.y() < 0; }) ||
         all([&](const Eigen::Vector3d& p) { return p.x() > screen.width * p.z(); }) ||
         all([&](const Eigen::Vector3d& p) { return p.y() > screen.height * p.z(); });
}

void AddPiece(SnappedPoint a, SnappedPoint b, SnappedPoint c, const Screen& screen, ScreenTriangle* triangle) {
  const int64_t area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  if (area <= 0) return;  // nothing is left of it after snapping
  ScreenPiece piece;
  std::tie(piece.x_begin, piece.x_end) =
      PixelRange(std::min({a.x, b.x, c.x}), std::max({a.x, b.x, c.x}), screen.reach, screen.width);
  std::tie(piece.y_begin, piece.y_end) =
      PixelRange(std::min({a.y, b.y, c.y}), std::max({a.y, b.y, c.y}), screen.reach, screen.height);
  if (piece.x_begin >= piece.x_end || piece.y_begin >= piece.y_end) return;
  piece.edges = {MakeEdge(a, b), MakeEdge(b, c), MakeEdge(c, a)};
  triangle->pieces[triangle->count++] = piece;
}

}  // namespace

ProjectedPoint ProjectPoint(const PixelFromMesh& pixel_from_mesh, const Eigen::Vector3f& point, double near_mm) {
  ProjectedPoint projected;
  projected.homogeneous = pixel_from_mesh.leftCols<3>() * point.cast<double>() + pixel_from_mesh.col(3);
  const Eigen::Vector3d& p = projected.homogeneous;
  projected.in_guard = p.z() >= near_mm && std::isfinite(p.z()) && std::abs(p.x()) <= kGuardPx * p.z() &&
                       std::abs(p.y()) <= kGuardPx * p.z();
  if (projected.in_guard) projected.snapped = Snap(p);
  return projected;
}

bool SetUpTriangle(const ProjectedPoint& p0, const ProjectedPoint& p1, const ProjectedPoint& p2, const Screen& screen,
                   ScreenTriangle* triangle) {
  Eigen::Matrix3d corners;
  corners << p0.homogeneous, p1.homogeneous, p2.homogeneous;
  // Six times the volume of the triangle and the camera's centre: negative when seen counter-clockwise, y down.
  const double volume = corners.determinant();
  if (volume == 0 || (screen.cull_back_faces && volume > 0) || !corners.allFinite()) return false;
  const bool turned = volume < 0;
  const ProjectedPoint &first = turned ? p2 : p0, &last = turned ? p0 : p2;
  Polygon polygon;
  for (const ProjectedPoint* p : {&first, &p1, &last}) polygon.Add(p->homogeneous);
  triangle->count = 0;
  if (p0.in_guard && p1.in_guard && p2.in_guard) {
    if (Outside(polygon, screen)) return false;
    AddPiece(first.snapped, p1.snapped, last.snapped, screen, triangle);
  } else {
    polygon = ClipToGuard(polygon, screen.near_mm);
    if (!std::all_of(polygon.points.begin(), polygon.points.begin() + polygon.size, CanSnap)) return false;
    for (int i = 2; i < polygon.size; ++i) {
      AddPiece(Snap(polygon.points[0]), Snap(polygon.points[i - 1]), Snap(polygon.points[i]), screen, triangle);
    }
  }
  triangle->weights = corners.inverse();
  if (triangle->count == 0 || !triangle->weights.allFinite()) return false;
  double nearest = polygon.points[0].z(), farthest = nearest;
  for (int i = 1; i < polygon.size; ++i) {
    nearest = std::min(nearest, polygon.points[i].z());
    farthest = std::max(farthest, polygon.points[i].z());
  }
  triangle->least_over_depth = 1 / farthest;
  triangle->most_over_depth = 1 / nearest;
  return true;
}

}  // namespace likeness
