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
const Kernel kKernel_avx512 = {
    .name = "avx512",
    .full_precision = true,
    .fixed_point = false,
    .element_bytes = 4,
    .bias_bytes = 2,
    .dense_bytes = 2,
    .available = Available,
    .enter = Enter,
    .leave = Leave,
    .weight_bytes = WeightBytes,
    .pack_weights = PackWeights,
    .pack_bias = PackHalfBias,
    .pixel_bias_bytes = PixelBiasBytes,
    .pack_pixel_bias = PackPixelBias,
    .pack_dense = PackDense,
    .store = StoreFeatures,
    .rows = Rows,
    .pixels = Pixels,
    .block = Block,
    .finish = Finish,
    .dense = Dense,
    .convert = Convert,
};

}  // namespace likeness
