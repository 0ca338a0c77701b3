// AVX-512.

#define LIKENESS_VECTOR_BYTES 64
#include "likeness/render/raster_avx_impl.h"

namespace likeness {
namespace {

inline uint32_t BitsOf(const Ints& mask) { return _mm512_movepi32_mask((__m512i)mask); }

bool Available() {
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
}

}  // namespace

extern const RasterKernel kRasterKernel_avx512;
const RasterKernel kRasterKernel_avx512 = {"avx512", Available, DrawTriangle<1>, DrawTriangle<kMostSamples>,
                                           Average,  Halve};

}  // namespace likeness
