#include "likeness/render/rasterizer.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <tuple>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"
#include "likeness/image/srgb.h"

namespace likeness {
namespace {

constexpr int kSubpixels = 256;  // a power of two
// Triangles are cut where |x| or |y| exceeds this many pixels, so that products of snapped coordinates fit 64 bits.
constexpr double kGuardPx = 1 << 20;

struct SnappedPoint {
  int64_t x = 0, y = 0;  // 1/256 pixel
};

// a x + b y + c >= 0 inside, in snapped coordinates; the top-left rule is in c.
struct Edge {
  int64_t a = 0, b = 0, c = 0;

  int64_t At(int64_t x, int64_t y) const { return a * x + b * y + c; }
};

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

// A piece of a triangle after clipping, ready to scan.
struct Piece {
  int triangle = 0;
  std::array<Edge, 3> edges;
  int x_begin = 0, x_end = 0, y_begin = 0, y_end = 0;  // pixels whose centres it may cover
  // Rows: weights of the three corners divided by depth, as linear functions of (x, y, 1) in pixels.
  Eigen::Matrix3d weights;
};

using Polygon = std::vector<Eigen::Vector3d>;  // homogeneous pixel coordinates (x z, y z, z)

// Keeps the part of a convex polygon where plane . point >= offset (Sutherland and Hodgman 1974).
Polygon Clip(const Polygon& polygon, const Eigen::Vector3d& plane, double offset) {
  Polygon kept;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector3d &from = polygon[i], &to = polygon[(i + 1) % polygon.size()];
    const double d0 = plane.dot(from) - offset, d1 = plane.dot(to) - offset;
    if (d0 >= 0) kept.push_back(from);
    if ((d0 >= 0) != (d1 >= 0)) {
      // Always from the inner to the outer point, so that neighbours cut a shared edge at the same place.
      const double t = d0 >= 0 ? d0 / (d0 - d1) : d1 / (d1 - d0);
      kept.push_back(d0 >= 0 ? Eigen::Vector3d(from + t * (to - from)) : Eigen::Vector3d(to + t * (from - to)));
    }
  }
  return kept;
}

// Pixels whose centres lie between two snapped coordinates.
std::pair<int, int> PixelRange(int64_t low, int64_t high, int size) {
  const auto ceil_div = [](int64_t value) { return (value + kSubpixels - 1) >> 8; };
  static_assert(kSubpixels == 1 << 8);
  const int64_t begin = ceil_div(low - kSubpixels / 2), end = ((high - kSubpixels / 2) >> 8) + 1;
  return {static_cast<int>(std::clamp<int64_t>(begin, 0, size)), static_cast<int>(std::clamp<int64_t>(end, 0, size))};
}

// All triangles of a mesh, projected and cut, ready to be scanned in any rows.
class ProjectedMesh {
 public:
  ProjectedMesh(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles,
                const PixelFromMesh& pixel_from_mesh, int width, int height, const RasterOptions& options)
      : width_(width), height_(height), options_(options) {
    LIKENESS_CHECK(width > 0 && height > 0);
    const Eigen::Matrix3d rotation = pixel_from_mesh.leftCols<3>();
    const Eigen::Vector3d translation = pixel_from_mesh.col(3);
    std::vector<Eigen::Vector3d> points(vertices.rows());
    for (Eigen::Index i = 0; i < vertices.rows(); ++i) {
      points[i] = rotation * vertices.row(i).transpose().cast<double>() + translation;
    }
    pieces_.reserve(triangles.size() / 2);
    for (size_t t = 0; t < triangles.size(); ++t) {
      Add(static_cast<int>(t), points[triangles[t][0]], points[triangles[t][1]], points[triangles[t][2]]);
    }
  }

  // Fragments of rows y_begin ... y_end - 1; `rows` holds them, freshly made.
  void Scan(int y_begin, int y_end, std::span<Fragment> rows) const {
    LIKENESS_CHECK(rows.size() == static_cast<size_t>(y_end - y_begin) * width_);
    for (const Piece& piece : pieces_) {
      for (int y = std::max(y_begin, piece.y_begin); y < std::min(y_end, piece.y_end); ++y) {
        ScanRow(piece, y, &rows[static_cast<size_t>(y - y_begin) * width_]);
      }
    }
  }

 private:
  void Add(int triangle, const Eigen::Vector3d& p0, const Eigen::Vector3d& p1, const Eigen::Vector3d& p2) {
    Eigen::Matrix3d corners;
    corners << p0, p1, p2;
    if (!corners.allFinite()) return;
    // Six times the volume of the triangle and the camera's centre: negative when seen counter-clockwise, y down.
    const double volume = corners.determinant();
    if (volume == 0 || (options_.cull_back_faces && volume > 0)) return;
    Polygon polygon = {p0, p1, p2};
    if (volume < 0) std::reverse(polygon.begin(), polygon.end());
    const auto in_guard = [&](const Eigen::Vector3d& p) {
      return p.z() >= options_.near_mm && std::abs(p.x()) <= kGuardPx * p.z() && std::abs(p.y()) <= kGuardPx * p.z();
    };
    if (in_guard(p0) && in_guard(p1) && in_guard(p2)) {
      if (Outside(p0, p1, p2)) return;
    } else {
      polygon = Clip(polygon, {0, 0, 1}, options_.near_mm);
      polygon = Clip(polygon, {1, 0, kGuardPx}, 0);
      polygon = Clip(polygon, {-1, 0, kGuardPx}, 0);
      polygon = Clip(polygon, {0, 1, kGuardPx}, 0);
      polygon = Clip(polygon, {0, -1, kGuardPx}, 0);
    }
    Piece piece;
    piece.triangle = triangle;
    piece.weights = corners.inverse();
    std::vector<SnappedPoint> snapped;
    for (const Eigen::Vector3d& p : polygon) {
      snapped.push_back({std::llround(p.x() / p.z() * kSubpixels), std::llround(p.y() / p.z() * kSubpixels)});
    }
    for (size_t i = 2; i < snapped.size(); ++i) AddPiece(&piece, snapped[0], snapped[i - 1], snapped[i]);
  }

  // Whether corners before the camera lie all to one side of the picture; of a crop's triangles most do.
  bool Outside(const Eigen::Vector3d& p0, const Eigen::Vector3d& p1, const Eigen::Vector3d& p2) const {
    const auto all = [&](const auto& beyond) { return beyond(p0) && beyond(p1) && beyond(p2); };
    return all([](const Eigen::Vector3d& p) { return p.x() < 0; }) ||
           all([](const Eigen::Vector3d& p) { return p.y() < 0; }) ||
           all([&](const Eigen::Vector3d& p) { return p.x() > width_ * p.z(); }) ||
           all([&](const Eigen::Vector3d& p) { return p.y() > height_ * p.z(); });
  }

  void AddPiece(Piece* piece, SnappedPoint a, SnappedPoint b, SnappedPoint c) {
    const int64_t area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (area <= 0) return;  // nothing is left of it after snapping
    std::tie(piece->x_begin, piece->x_end) = PixelRange(std::min({a.x, b.x, c.x}), std::max({a.x, b.x, c.x}), width_);
    std::tie(piece->y_begin, piece->y_end) = PixelRange(std::min({a.y, b.y, c.y}), std::max({a.y, b.y, c.y}), height_);
    if (piece->x_begin >= piece->x_end || piece->y_begin >= piece->y_end) return;
    piece->edges = {MakeEdge(a, b), MakeEdge(b, c), MakeEdge(c, a)};
    pieces_.push_back(*piece);
  }

  static void ScanRow(const Piece& piece, int y, Fragment* row) {
    const int64_t first_x = int64_t{piece.x_begin} * kSubpixels + kSubpixels / 2;
    const int64_t snapped_y = int64_t{y} * kSubpixels + kSubpixels / 2;
    std::array<int64_t, 3> at, step;
    for (int e = 0; e < 3; ++e) {
      at[e] = piece.edges[e].At(first_x, snapped_y);
      step[e] = piece.edges[e].a * kSubpixels;
    }
    for (int x = piece.x_begin; x < piece.x_end; ++x) {
      if ((at[0] | at[1] | at[2]) >= 0) Shade(piece, x, y, &row[x]);
      for (int e = 0; e < 3; ++e) at[e] += step[e];
    }
  }

  static void Shade(const Piece& piece, int x, int y, Fragment* fragment) {
    const Eigen::Vector3d over_depth = piece.weights * Eigen::Vector3d(x + 0.5, y + 0.5, 1);
    const double depth = 1 / over_depth.sum();
    if (!(depth > 0 && static_cast<float>(depth) < fragment->depth_mm)) return;
    // Snapping lets a pixel centre lie a trifle outside the true triangle.
    const double b1 = std::clamp(over_depth[1] * depth, 0.0, 1.0);
    const double b2 = std::clamp(over_depth[2] * depth, 0.0, 1 - b1);
    *fragment = {piece.triangle, static_cast<float>(b1), static_cast<float>(b2), static_cast<float>(depth)};
  }

  const int width_;
  const int height_;
  const RasterOptions options_;
  std::vector<Piece> pieces_;
};

// Calls band(y_begin, y_end) for bands that cover all rows, on all threads.
template <typename Band>
void ForBands(int height, int rows, const Band& band) {
  ParallelFor((height + rows - 1) / rows, [&](int64_t i) {
    band(static_cast<int>(i) * rows, std::min<int>(height, (static_cast<int>(i) + 1) * rows));
  });
}

constexpr int kBandRows = 32;

Eigen::Vector2f UvAt(const MeshTopology& topology, const Fragment& fragment) {
  const Eigen::Vector3i& corners = topology.triangle_uvs[fragment.triangle];
  return (1 - fragment.b1 - fragment.b2) * topology.uvs[corners[0]] + fragment.b1 * topology.uvs[corners[1]] +
         fragment.b2 * topology.uvs[corners[2]];
}

// `share` of b over a, 0 ... 255.
float Mix(float a, float b, float share, bool as_light) {
  if (share == 0 || share == 1) return share == 0 ? a : b;
  if (!as_light) return a + share * (b - a);
  const float light_a = LinearFromSrgb(a / 255), light_b = LinearFromSrgb(b / 255);
  return 255 * SrgbFromLinear(light_a + share * (light_b - light_a));
}

}  // namespace

void RasterOptions::Check() const {
  if (!(near_mm > 0 && std::isfinite(near_mm)))
    throw Error("the near plane must lie at more than 0 mm, not {}", near_mm);
}

void DrawOptions::Check() const {
  raster.Check();
  if (supersample < 1 || supersample > 8) throw Error("supersample must be 1 ... 8, not {}", supersample);
  for (const float value : background) {
    if (!(value >= 0 && value <= 255)) throw Error("a background colour must be 0 ... 255, not {}", value);
  }
}

PixelFromMesh ProjectionOf(const Camera& camera, const RigidTransform& world_from_mesh, int x0, int y0) {
  const RigidTransform cam_from_mesh = camera.cam_from_world * world_from_mesh;
  Eigen::Matrix3d intrinsics = camera.intrinsics;
  intrinsics(0, 2) -= x0;
  intrinsics(1, 2) -= y0;
  PixelFromMesh projection;
  projection << intrinsics * cam_from_mesh.rotation, intrinsics * cam_from_mesh.translation;
  return projection;
}

FragmentImage Rasterize(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles, const Camera& camera,
                        const RigidTransform& world_from_mesh, const RasterOptions& options) {
  return Rasterize(vertices, triangles, ProjectionOf(camera, world_from_mesh), camera.width, camera.height, options);
}

FragmentImage Rasterize(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles,
                        const PixelFromMesh& pixel_from_mesh, int width, int height, const RasterOptions& options) {
  options.Check();
  const ProjectedMesh mesh(vertices, triangles, pixel_from_mesh, width, height, options);
  FragmentImage image = {width, height, {}};
  const auto stride = static_cast<size_t>(width);
  image.fragments.resize(stride * height);
  ForBands(height, kBandRows, [&](int y_begin, int y_end) {
    mesh.Scan(y_begin, y_end, std::span(image.fragments).subspan(y_begin * stride, (y_end - y_begin) * stride));
  });
  return image;
}

Eigen::Vector3f SampleTexture(const ImageF& texture, const Eigen::Vector2f& uv) {
  const float x = std::clamp(uv.x() * static_cast<float>(texture.width()) - 0.5f, 0.0f, texture.width() - 1.0f);
  const float y = std::clamp((1 - uv.y()) * static_cast<float>(texture.height()) - 0.5f, 0.0f, texture.height() - 1.0f);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, texture.width() - 1), y1 = std::min(y0 + 1, texture.height() - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  using Texel = Eigen::Map<const Eigen::Vector3f>;
  return (1 - fy) * ((1 - fx) * Texel(texture.at(x0, y0)) + fx * Texel(texture.at(x1, y0))) +
         fy * ((1 - fx) * Texel(texture.at(x0, y1)) + fx * Texel(texture.at(x1, y1)));
}

Rendering DrawMesh(const Vertices& vertices, const MeshTopology& topology, const ImageF& texture, const Camera& camera,
                   const RigidTransform& world_from_mesh, const DrawOptions& options) {
  options.Check();
  LIKENESS_CHECK(camera.width > 0 && camera.height > 0 && !texture.empty() && texture.channels() == 3);
  LIKENESS_CHECK(vertices.rows() == topology.vertex_count);
  const int n = options.supersample, width = camera.width * n;
  const Camera fine = camera.Resized(width, camera.height * n);
  const ProjectedMesh mesh(vertices, topology.triangles, ProjectionOf(fine, world_from_mesh), fine.width, fine.height,
                           options.raster);
  Rendering rendering = {ImageU8(camera.width, camera.height, 3), ImageU8(camera.width, camera.height, 1)};
  ForBands(camera.height, std::max(1, kBandRows / n), [&](int y_begin, int y_end) {
    std::vector<Fragment> fragments(static_cast<size_t>(y_end - y_begin) * n * width);
    mesh.Scan(y_begin * n, y_end * n, fragments);
    for (int y = y_begin; y < y_end; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        Eigen::Vector3f sum = Eigen::Vector3f::Zero();
        int covered = 0;
        for (int sample = 0; sample < n * n; ++sample) {
          const size_t row = static_cast<size_t>(y - y_begin) * n + sample / n;
          const Fragment& fragment = fragments[row * width + x * n + sample % n];
          if (fragment.triangle < 0) continue;
          ++covered;
          sum += SampleTexture(texture, UvAt(topology, fragment));
        }
        for (int c = 0; c < 3; ++c) {
          const float mesh_colour = std::clamp(sum[c] / static_cast<float>(std::max(1, covered)), 0.0f, 255.0f);
          const float share = static_cast<float>(covered) / static_cast<float>(n * n);
          const float colour = Mix(options.background[c], mesh_colour, share, options.linear_edges);
          rendering.colour.at(x, y)[c] = static_cast<uint8_t>(colour + 0.5f);
        }
        *rendering.coverage.at(x, y) = static_cast<uint8_t>((covered * 255 + n * n / 2) / (n * n));
      }
    }
  });
  return rendering;
}

}  // namespace likeness
