// Mesh + texture + camera -> pixels, on the CPU: the plain renderer that faster ones are tested against.
//
// Coverage is exact (projected_triangle.h), so triangles that share an edge cover every pixel centre between them
// exactly once. Barycentric weights come from the unsnapped triangle in homogeneous coordinates, hence
// perspective-correct, also for triangles that reach behind the camera.

#pragma once

#include <array>
#include <limits>
#include <vector>

#include "likeness/geometry/camera.h"
#include "likeness/geometry/mesh.h"
#include "likeness/geometry/rigid.h"
#include "likeness/image/image.h"
#include "likeness/render/projected_triangle.h"

namespace likeness {

struct RasterOptions {
  bool cull_back_faces = true;  // triangles seen clockwise are left out
  double near_mm = 10;          // what is nearer to the camera's plane is cut off; > 0

  void Check() const;  // throws Error
};

// What one pixel centre sees.
struct Fragment {
  int triangle = -1;  // -1: nothing
  float b1 = 0;       // barycentric weights of the triangle's second and third corner, in [0, 1]
  float b2 = 0;
  float depth_mm = std::numeric_limits<float>::infinity();  // along the camera's z axis
};

struct FragmentImage {
  int width = 0;
  int height = 0;
  std::vector<Fragment> fragments;  // row by row from the top

  const Fragment& at(int x, int y) const { return fragments[static_cast<size_t>(y) * width + x]; }
};

// Of the part of the camera's image that begins at pixel (x0, y0).
PixelFromMesh ProjectionOf(const Camera& camera, const RigidTransform& world_from_mesh, int x0 = 0, int y0 = 0);

// The nearest triangle at every pixel centre; of equally near ones, the first.
//   vertices         [n, 3] mm, in the mesh's own space
//   camera           with width and height
FragmentImage Rasterize(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles, const Camera& camera,
                        const RigidTransform& world_from_mesh, const RasterOptions& options = {});

// The same for any projection, such as a crop's; width and height in pixels, more than 0.
FragmentImage Rasterize(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles,
                        const PixelFromMesh& pixel_from_mesh, int width, int height, const RasterOptions& options = {});

struct DrawOptions {
  RasterOptions raster;
  int supersample = 2;                          // n x n samples a pixel, 1 ... 8
  std::array<float, 3> background = {0, 0, 0};  // RGB, 0 ... 255
  // Pixels that the mesh covers partly mix it with the background as light, as a camera does, taking both for
  // sRGB-encoded. Off: the encoded values are mixed.
  bool linear_edges = true;

  void Check() const;  // throws Error
};

struct Rendering {
  ImageU8 colour;    // RGB
  ImageU8 coverage;  // 1 channel: share of the pixel's samples that the mesh covers, 0 ... 255
};

// The textured mesh as the camera sees it. A pixel's samples of the mesh are averaged in the texture's own encoding.
//   texture  3 channels, 0 ... 255, row 0 is v = 1; any size
Rendering DrawMesh(const Vertices& vertices, const MeshTopology& topology, const ImageF& texture, const Camera& camera,
                   const RigidTransform& world_from_mesh, const DrawOptions& options = {});

// Bilinear sample of a texture; (u, v) = (0, 1) is the image's top left corner, texel centres lie at +0.5 texel, the
// border is repeated.
Eigen::Vector3f SampleTexture(const ImageF& texture, const Eigen::Vector2f& uv);

}  // namespace likeness
