// Draws a textured mesh at frame rates on the CPU, for one eye or two at once: for tests, servers and machines without
// a GPU.
//
// It covers exactly the pixels that render/rasterizer.h covers. Colours are sampled trilinearly from mip maps of the
// texture, of the level whose texels are as large as a pixel's footprint along the longer of its sides, as OpenGL does.
// Against exact arithmetic, a colour may be off by 2 where neighbouring levels differ as much as they can (the
// logarithm is within 0.005); where two surfaces are within float32 of the same depth, the other may be seen.

#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "likeness/base/team.h"
#include "likeness/geometry/mesh.h"
#include "likeness/render/mip_chain.h"
#include "likeness/render/projected_triangle.h"
#include "likeness/render/raster_kernel.h"

namespace likeness {

struct FrameRendererOptions {
  std::string kernel = "auto";  // or one by name: AvailableRasterKernels()
  bool anti_alias = false;      // eight samples a pixel, each with a depth; colours once a pixel and triangle
  bool cull_back_faces = true;  // triangles seen clockwise are left out
  double near_mm = 10;          // what is nearer to the camera's plane is cut off; > 0
  std::array<uint8_t, 3> background = {0, 0, 0};
  // Opacity is the share of a pixel that the mesh covers, its colour the mesh's alone, black where there is none.
  // Otherwise pixels that are covered partly mix mesh and background as light, and all are opaque.
  bool transparent = false;
  int threads = 2;             // 1 to 64
  std::shared_ptr<Team> team;  // threads shared with others who work by turns, in place of own ones

  void Check() const;  // throws Error
};

// Of the last frame, by the clock.
struct FrameTimes {
  double mip_maps_ms = 0;
  double vertices_ms = 0;  // projecting, culling, sorting into tiles
  double raster_ms = 0;
};

class FrameRenderer : private Team::Work {
 public:
  struct View {
    PixelFromMesh pixel_from_mesh = PixelFromMesh::Zero();  // ProjectionOf(camera, world_from_mesh)
    int width = 0, height = 0;                              // px, 1 to 16384
    const uint8_t* texture = nullptr;                       // RGBA8, opaque, row 0 is v = 1, rows without gaps
    uint8_t* pixels = nullptr;                              // RGBA8
    int64_t row_bytes = 0;                                  // from a row to the next, at least 4 x width
  };
  static constexpr int kMostViews = 2;

  //   texture_size  texels a side: a power of two, 16 to 4096
  // Throws Error where options do not fit.
  FrameRenderer(const MeshTopology& topology, int texture_size, const FrameRendererOptions& options = {});
  ~FrameRenderer() override;

  // Overwrites every pixel of the views. The same input gives the same bytes, whatever the number of threads. Allocates
  // nothing but where a frame has more triangles or tiles than all before it.
  //   vertices  x y z in the mesh's own space, mm, [3 vertex_count]
  void Draw(std::span<const float> vertices, std::span<const View> views);

  const FrameTimes& times() const { return times_; }
  const char* kernel() const { return kernel_.name; }

 private:
  struct Eye;
  struct Share;
  enum Phase { kMipMaps, kVertices, kTriangles, kTiles, kPhases };

  unsigned Enter() override { return 0; }
  void Leave(unsigned) override {}
  void Run(int phase, int thread) override;

  void MakeMipMaps();
  void Project(int thread);
  void SetUpTriangles(int thread);
  void AddTriangle(Share& share, const Eye& eye, int triangle, const ScreenTriangle& seen) const;
  void DrawTiles(int thread);
  void DrawTile(Share& own, const Eye& eye, int tile) const;
  void FillTile(const View& view, const RasterTile& tile) const;
  void WriteTile(const View& view, const RasterTile& tile) const;
  void WriteSampledRow(const RasterTile& tile, int row, uint32_t* pixels) const;
  uint32_t MixedPixel(const uint32_t* samples) const;

  const FrameRendererOptions options_;
  const RasterKernel& kernel_;
  const MeshTopology topology_;
  const int texture_size_;
  const uint32_t background_;  // RGBA8 of pixels without a mesh
  std::shared_ptr<Team> team_;
  std::vector<Share> shares_;  // one a thread
  std::vector<Eye> eyes_;
  int eye_count_ = 0;  // of the frame at hand
  std::span<const float> vertices_;
  std::atomic<int> next_part_ = 0, next_tile_ = 0;
  std::chrono::steady_clock::time_point began_[kPhases + 1];
  FrameTimes times_;
};

}  // namespace likeness
