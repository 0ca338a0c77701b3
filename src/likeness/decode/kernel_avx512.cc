// float32 on AVX-512; biases and dense weights in half precision.

#include <immintrin.h>

#define LIKENESS_VECTOR_BYTES 64
#define LIKENESS_TILE_ROWS 12
#define LIKENESS_HALF
#include "likeness/decode/avx512_impl.h"
#include "likeness/decode/float_kernel_impl.h"

namespace likeness {
namespace {

bool Available() { return HasAvx512(); }

}  // namespace

extern const Kernel kKernel_avx512;
const Kernel kKernel_avx512 = {"avx512",
                               true,
                               4,
                               2,
                               2,
                               Available,
                               Enter,
                               Leave,
                               WeightBytes,
                               PackWeights,
                               PackBias,
                               PixelBiasBytes,
                               PackPixelBias,
                               PackDense,
                               StoreFeatures,
                               Rows,
                               Pixels,
                               Block,
                               Finish,
                               Dense,
                               Convert};

}  // namespace likeness
