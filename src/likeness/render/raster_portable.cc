// Plain C++, for any processor.

#define LIKENESS_VECTOR_BYTES 16
#include "likeness/render/raster_impl.h"

namespace likeness {
namespace {

inline void LoadPair(const uint8_t* from, TexelPair* pair) {
  for (int i = 0; i < 8; ++i) (*pair)[i] = from[i];
}

inline uint32_t Pack(const Texel* colour) {
  uint8_t bytes[4];
  for (int i = 0; i < 4; ++i) bytes[i] = static_cast<uint8_t>((*colour)[i]);
  uint32_t packed = 0;
  __builtin_memcpy(&packed, bytes, 4);
  return packed;
}

inline uint32_t BitsOf(const Ints& mask) {
  uint32_t bits = 0;
  for (int i = 0; i < kLanes; ++i) bits |= static_cast<uint32_t>(mask[i] & 1 << i);
  return bits;
}

bool Available() { return true; }

}  // namespace

extern const RasterKernel kRasterKernel_portable;
const RasterKernel kRasterKernel_portable = {"portable", Available, DrawTriangle<1>, DrawTriangle<kMostSamples>,
                                             Average,    Halve};

}  // namespace likeness
