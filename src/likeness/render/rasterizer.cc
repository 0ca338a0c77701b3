#include "likeness/render/rasterizer.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"
#include "likeness/image/srgb.h"

namespace likeness {
namespace {

// A triangle, or a piece of one that was cut, ready to scan.
struct Piece {
  int triangle = 0;
  ScreenPiece screen;
  Eigen::Matrix3d weights;
  double least_over_depth = 0, most_over_depth = 0;
};

// All triangles of a mesh, projected and cut, ready to be scanned in any rows.
class ProjectedMesh {
 public:
  ProjectedMesh(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles,
                const PixelFromMesh& pixel_from_mesh, int width, int height, const RasterOptions& options)
      : width_(width) {
    LIKENESS_CHECK(width > 0 && height > 0);
    const Screen screen = {width, height, 0, options.cull_back_faces, options.near_mm};
    std::vector<ProjectedPoint> points(vertices.rows());
    for (Eigen::Index i = 0; i < vertices.rows(); ++i) {
      points[i] = ProjectPoint(pixel_from_mesh, vertices.row(i).transpose(), options.near_mm);
    }
    pieces_.reserve(triangles.size() / 2);
    ScreenTriangle seen;
    for (size_t t = 0; t < triangles.size(); ++t) {
      if (!SetUpTriangle(points[triangles[t][0]], points[triangles[t][1]], points[triangles[t][2]], screen, &seen)) {
        continue;
      }
      for (int i = 0; i < seen.count; ++i) {
        pieces_.push_back(
            {static_cast<int>(t), seen.pieces[i], seen.weights, seen.least_over_depth, seen.most_over_depth});
      }
    }
  }

  // Fragments of rows y_begin ... y_end - 1; `rows` holds them, freshly made.
  void Scan(int y_begin, int y_end, std::span<Fragment> rows) const {
    LIKENESS_CHECK(rows.size() == static_cast<size_t>(y_end - y_begin) * width_);
    for (const Piece& piece : pieces_) {
      for (int y = std::max(y_begin, piece.screen.y_begin); y < std::min(y_end, piece.screen.y_end); ++y) {
        ScanRow(piece, y, &rows[static_cast<size_t>(y - y_begin) * width_]);
      }
    }
  }

 private:
  static void ScanRow(const Piece& piece, int y, Fragment* row) {
    const int64_t first_x = int64_t{piece.screen.x_begin} * kSubpixels + kSubpixels / 2;
    const int64_t snapped_y = int64_t{y} * kSubpixels + kSubpixels / 2;
    std::array<int64_t, 3> at, step;
    for (int e = 0; e < 3; ++e) {
      at[e] = piece.screen.edges[e].At(first_x, snapped_y);
      step[e] = piece.screen.edges[e].a * kSubpixels;
    }
    for (int x = piece.screen.x_begin; x < piece.screen.x_end; ++x) {
      if ((at[0] | at[1] | at[2]) >= 0) Shade(piece, x, y, &row[x]);
      for (int e = 0; e < 3; ++e) at[e] += step[e];
    }
  }

  static void Shade(const Piece& piece, int x, int y, Fragment* fragment) {
    const Eigen::Vector3d over_depth = piece.weights * Eigen::Vector3d(x + 0.5, y + 0.5, 1);
    const double depth = 1 / std::clamp(over_depth.sum(), piece.least_over_depth, piece.most_over_depth);
    if (!(static_cast<float>(depth) < fragment->depth_mm)) return;
    // Snapping lets a pixel centre lie a trifle outside the true triangle.
    const double b1 = std::clamp(over_depth[1] * depth, 0.0, 1.0);
    const double b2 = std::clamp(over_depth[2] * depth, 0.0, 1 - b1);
    *fragment = {piece.triangle, static_cast<float>(b1), static_cast<float>(b2), static_cast<float>(depth)};
  }

  const int width_;
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
  return as_light ? MixSrgb(a, b, share) : a + share * (b - a);
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
