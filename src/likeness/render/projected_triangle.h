// The part of rasterising that decides which pixels a triangle covers, for all rasterisers here, so that they agree
// exactly: corners are snapped to 1/256 pixel, edges are tested in integers with the top-left rule.

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace likeness {

inline constexpr int kSubpixels = 256;  // a power of two

// From a mesh's own space, mm, to homogeneous pixel coordinates (x z, y z, z) with z the depth in mm: K [R | t].
using PixelFromMesh = Eigen::Matrix<double, 3, 4>;

struct SnappedPoint {
  int64_t x = 0, y = 0;  // 1/256 pixel
};

// a x + b y + c >= 0 inside, in snapped coordinates; the top-left rule is in c.
struct Edge {
  int64_t a = 0, b = 0, c = 0;

  int64_t At(int64_t x, int64_t y) const { return a * x + b * y + c; }
};

// What is drawn of the projected triangles.
struct Screen {
  int width = 0, height = 0;    // px
  int reach = 0;                // 1/256 pixel: how far a pixel's samples lie from its centre along x or y
  bool cull_back_faces = true;  // triangles seen clockwise are left out
  double near_mm = 10;          // what is nearer to the camera's plane is cut off; > 0
};

struct ProjectedPoint {
  Eigen::Vector3d homogeneous;
  SnappedPoint snapped;   // of a point in the guard
  bool in_guard = false;  // finite, behind the near plane, and not so far outside that triangles must be cut
};
ProjectedPoint ProjectPoint(const PixelFromMesh& pixel_from_mesh, const Eigen::Vector3f& point, double near_mm);

// A triangle, or a piece of one that was cut.
struct ScreenPiece {
  std::array<Edge, 3> edges;
  int x_begin = 0, x_end = 0, y_begin = 0, y_end = 0;  // pixels, within the screen, that have a sample in its box
};

struct ScreenTriangle {
  // Rows: weights of the three corners divided by depth, as linear functions of (x, y, 1) in pixels (Olano and Greer
  // 1997). They come from the unsnapped triangle.
  Eigen::Matrix3d weights;
  // 1 / mm: what 1 / depth is between. Snapping lets a pixel centre lie a trifle outside the true triangle, of which
  // slivers can make much.
  double least_over_depth = 0, most_over_depth = 0;
  int count = 0;
  std::array<ScreenPiece, 6> pieces;
};

// False when nothing of the triangle is to be drawn.
bool SetUpTriangle(const ProjectedPoint& p0, const ProjectedPoint& p1, const ProjectedPoint& p2, const Screen& screen,
                   ScreenTriangle* triangle);

}  // namespace likeness
