// The coarser levels of a texture, for the frame renderer: each texel the mean of four of the next finer level.

#pragma once

#include <cstdint>
#include <vector>

#include "likeness/render/raster_kernel.h"

namespace likeness {

class MipChain {
 public:
  static constexpr int kParts = 8;  // that threads may make at the same time

  // `size` a power of two, 16 to 4096.
  explicit MipChain(int size);

  // RGBA8, row 0 is v = 1, rows without gaps; it stays the caller's and is the finest level.
  void SetTexture(const uint8_t* pixels) { maps_.levels[0] = pixels; }
  // An eighth of the rows of all levels of at least 8 x 8 texels.
  void MakePart(const RasterKernel& kernel, int part);
  // The levels that remain, when all parts are made.
  void MakeRest(const RasterKernel& kernel);

  const MipMaps& maps() const { return maps_; }

 private:
  void MakeRows(const RasterKernel& kernel, int level, int begin, int end);

  MipMaps maps_ = {};
  std::vector<uint8_t> memory_;
  uint8_t* levels_[kMostLevels] = {};
};

}  // namespace likeness
