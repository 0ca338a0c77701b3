// The inner loops of the frame renderer, in variants for the processor's instruction sets: a file each, compiled with
// its own flags. Plain data and function pointers only: no kernel's file may call an inline function of another header,
// since the linker might choose its copy of that function for code that runs on lesser processors.

#pragma once

#include <stdint.h>

namespace likeness {

// The picture is drawn in tiles that stay in the cache.
constexpr int kTileWidth = 64;
constexpr int kTileHeight = 32;
constexpr int kTilePitch = kTileWidth + 16;  // a vector may reach beyond the end of a row
constexpr int kTileTexels = kTilePitch * kTileHeight;

constexpr int kMostSamples = 8;
constexpr int kMostLevels = 12;  // 4096 x 4096 down to 2 x 2

// Where a pixel's eight samples lie, in 1/16 pixel from its centre: no two in one row or column.
constexpr int kSampleX[kMostSamples] = {1, -1, 5, -3, -5, -7, 3, 7};
constexpr int kSampleY[kMostSamples] = {-3, 3, 1, -5, 5, -1, 7, -7};
constexpr int kSampleReach = 7;

// A linear function of the pixel, (x, y) = 0 at the centre of the first pixel of a triangle's box.
struct Plane {
  float at0, dx, dy;
};

// A triangle ready to be drawn. Texels are those of the finest level, from its top left corner.
struct RasterTriangle {
  // a x + b y + c / 256 >= 0 inside, (x, y) = 0 at the centre of the screen's first pixel, with the top-left rule in c.
  int64_t c[3];
  int32_t a[3], b[3];
  int32_t x_begin, x_end;  // pixels that may be covered
  int32_t y_begin, y_end;
  Plane over_depth;  // 1 / depth
  Plane u, v;        // texels / depth
  float least_over_depth, most_over_depth;
  float least_u, most_u, least_v, most_v;
};

// RGBA8, square, rows without gaps; level l has size >> l texels a side.
struct MipMaps {
  const uint8_t* levels[kMostLevels];
  int count;  // at least 2
  int size;   // of the finest level
};

// One tile of the picture; a plane of kTilePitch x kTileHeight for each sample of a pixel.
struct RasterTile {
  int x = 0, y = 0;  // of its first pixel
  int width = 0, height = 0;
  float* over_depth = nullptr;  // 0: nothing drawn
  uint32_t* colours = nullptr;
};

struct RasterKernel {
  const char* name;
  bool (*available)();

  // Draws what is nearer than what is there, with one sample a pixel, its centre, or with eight.
  void (*draw)(const RasterTriangle& triangle, const MipMaps& texture, const RasterTile& tile);
  void (*draw_samples)(const RasterTriangle& triangle, const MipMaps& texture, const RasterTile& tile);

  // Means of the samples of `count` pixels in each of the four channels, rounded.
  void (*average)(const uint32_t* colours, int count, uint32_t* pixels);

  // A row of the next coarser level: means of 2 x 2 texels, rounded. `count` texels to write.
  void (*halve)(const uint8_t* row0, const uint8_t* row1, int count, uint8_t* to);
};

}  // namespace likeness
