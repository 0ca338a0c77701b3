#include "likeness/validate/view_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "likeness/image/foreground.h"
#include "likeness/render/rasterizer.h"

namespace likeness {
namespace {

// Surfaces that turn away further show their detail squeezed, and lie at the silhouette.
constexpr double kLeastCosine = 0.35;

Vertices Mapped(const Vertices& vertices, const Eigen::Matrix3d& map) {
  if (map.isIdentity(0)) return vertices;
  return vertices * map.cast<float>().transpose();
}

FragmentImage Draw(const Placement& placement, const Vertices& mapped, const MeshTopology& topology) {
  RasterOptions options;
  options.cull_back_faces = false;
  return Rasterize(mapped, topology.triangles, placement.camera, placement.world_from_head, options);
}

double Halton(int index, int base) {
  double value = 0, digit = 1;
  for (int i = index; i > 0; i /= base) {
    digit /= base;
    value += digit * (i % base);
  }
  return value;
}

}  // namespace

std::vector<SurfacePoint> SpreadPoints(const Vertices& vertices, const MeshTopology& topology, int count) {
  std::vector<double> sums;
  double sum = 0;
  for (const Eigen::Vector3i& t : topology.triangles) {
    const Eigen::Vector3f a = vertices.row(t[0]), b = vertices.row(t[1]), c = vertices.row(t[2]);
    const double area = (b - a).cross(c - a).norm();
    sums.push_back(sum += std::isfinite(area) ? area : 0);
  }
  std::vector<SurfacePoint> points;
  if (!(sum > 0)) return points;
  for (int i = 0; i < count; ++i) {
    const auto found = std::upper_bound(sums.begin(), sums.end(), (i + 0.5) / count * sum);
    double b1 = Halton(i + 1, 2), b2 = Halton(i + 1, 3);
    if (b1 + b2 > 1) b1 = 1 - b1, b2 = 1 - b2;
    points.push_back(
        {static_cast<int>(std::min<std::ptrdiff_t>(found - sums.begin(), static_cast<std::ptrdiff_t>(sums.size()) - 1)),
         static_cast<float>(b1), static_cast<float>(b2)});
  }
  return points;
}

ImageU8 Silhouette(const Placement& placement, const Vertices& vertices, const MeshTopology& topology) {
  const FragmentImage drawn = Draw(placement, Mapped(vertices, placement.mesh_from_file), topology);
  ImageU8 silhouette(drawn.width, drawn.height, 1);
  for (size_t i = 0; i < drawn.fragments.size(); ++i)
    silhouette.values()[i] = drawn.fragments[i].triangle >= 0 ? 255 : 0;
  return silhouette;
}

ViewFit FitView(const View& view, const Placement& placement, const Vertices& vertices, const MeshTopology& topology,
                const std::vector<SurfacePoint>& points) {
  const Vertices mapped = Mapped(vertices, placement.mesh_from_file);
  const FragmentImage drawn = Draw(placement, mapped, topology);
  const Camera& camera = placement.camera;
  ViewFit fit;
  ImageU8 silhouette(drawn.width, drawn.height, 1);
  int64_t covered = 0;
  for (size_t i = 0; i < drawn.fragments.size(); ++i) {
    if (drawn.fragments[i].triangle < 0) continue;
    silhouette.values()[i] = 255;
    ++covered;
  }
  fit.size = static_cast<double>(covered) / static_cast<double>(std::max<size_t>(1, drawn.fragments.size()));
  if (!view.foreground.empty()) {
    const MaskOverlap overlap = Overlap(silhouette, view.foreground);
    fit.overlap = overlap.Iou();
    fit.inside = overlap.a > 0 ? overlap.both / overlap.a : 0;
  }

  const RigidTransform cam_from_head = camera.cam_from_world * placement.world_from_head;
  const double mesh_size = (mapped.colwise().maxCoeff() - mapped.colwise().minCoeff()).cast<double>().norm();
  fit.contrast.assign(points.size(), 0);
  fit.seen.assign(points.size(), 0);
  fit.at.assign(points.size(), Eigen::Vector2f::Zero());
  for (size_t i = 0; i < points.size(); ++i) {
    const SurfacePoint& point = points[i];
    const Eigen::Vector3i& t = topology.triangles[static_cast<size_t>(point.triangle)];
    const Eigen::Vector3d a = mapped.row(t[0]).cast<double>(), b = mapped.row(t[1]).cast<double>(),
                          c = mapped.row(t[2]).cast<double>();
    const Eigen::Vector3d in_cam = cam_from_head * (a + point.b1 * (b - a) + point.b2 * (c - a));
    if (!(in_cam.z() > 0)) continue;
    const Eigen::Vector3d normal = cam_from_head.rotation * (b - a).cross(c - a);
    if (!(std::abs(normal.dot(in_cam)) > kLeastCosine * normal.norm() * in_cam.norm())) continue;
    const Eigen::Vector2d pixel = (camera.intrinsics * in_cam).hnormalized();
    const double x = pixel.x() - 0.5, y = pixel.y() - 0.5;
    if (!(x >= 0 && y >= 0 && x < drawn.width - 1 && y < drawn.height - 1)) continue;
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const Fragment& fragment = drawn.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
    if (!(in_cam.z() < fragment.depth_mm + 0.02 * mesh_size)) continue;
    if (!view.foreground.empty() && *view.foreground.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y())) == 0)
      continue;
    const double right = x - column, lower = y - row;
    fit.contrast[i] = static_cast<float>(
        (1 - lower) * ((1 - right) * *view.contrast.at(column, row) + right * *view.contrast.at(column + 1, row)) +
        lower * ((1 - right) * *view.contrast.at(column, row + 1) + right * *view.contrast.at(column + 1, row + 1)));
    fit.seen[i] = 1;
    fit.at[i] = pixel.cast<float>();
  }
  return fit;
}

Agreement Agree(const ViewFit& a, const ViewFit& b) {
  double n = 0, sum_a = 0, sum_b = 0, aa = 0, bb = 0, ab = 0;
  for (size_t i = 0; i < a.seen.size(); ++i) {
    if (a.seen[i] == 0 || b.seen[i] == 0) continue;
    const double x = a.contrast[i], y = b.contrast[i];
    n += 1, sum_a += x, sum_b += y, aa += x * x, bb += y * y, ab += x * y;
  }
  Agreement agreement;
  agreement.points = static_cast<int>(n);
  if (n < kLeastPoints) return agreement;
  const double var_a = aa - sum_a * sum_a / n, var_b = bb - sum_b * sum_b / n;
  if (var_a > 1e-9 && var_b > 1e-9) agreement.correlation = (ab - sum_a * sum_b / n) / std::sqrt(var_a * var_b);
  return agreement;
}

void FitScore::Add(const ViewFit& fit) {
  ++views;
  if (fit.overlap < 0) return;
  ++views_with_foreground;
  overlap_sum += fit.overlap;
  inside_sum += fit.inside;
}

void FitScore::Add(const struct Agreement& agreement) {
  if (agreement.points < kLeastPoints) return;
  agreement_sum += agreement.correlation * agreement.points;
  agreement_weight += agreement.points;
}

}  // namespace likeness
