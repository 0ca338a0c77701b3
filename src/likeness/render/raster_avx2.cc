// AVX2 with FMA.

#define LIKENESS_VECTOR_BYTES 32
#include "likeness/render/raster_avx_impl.h"

namespace likeness {
namespace {

inline uint32_t BitsOf(const Ints& mask) { return static_cast<uint32_t>(_mm256_movemask_ps((__m256)mask)); }

bool Available() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }

}  // namespace

extern const RasterKernel kRasterKernel_avx2;
const RasterKernel kRasterKernel_avx2 = {"avx2",  Available, DrawTriangle<1>, DrawTriangle<kMostSamples>,
                                         Average, Halve};

}  // namespace likeness
