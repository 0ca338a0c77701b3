// float32 on AVX2 with FMA; biases and dense weights in half precision (F16C).

#include <immintrin.h>

#define LIKENESS_VECTOR_BYTES 32
#define LIKENESS_TILE_ROWS 6
#define LIKENESS_HALF
#include "likeness/decode/avx2_impl.h"
#include "likeness/decode/float_kernel_impl.h"

namespace likeness {
namespace {

bool Available() { return HasAvx2(); }

}  // namespace

extern const Kernel kKernel_avx2;
const Kernel kKernel_avx2 = {
    .name = "avx2",
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
