// 16-bit fixed-point features and weights on AVX2: twice the products an instruction that float32 has.

#include <immintrin.h>

#define LIKENESS_VECTOR_BYTES 32
#define LIKENESS_HALF
#define LIKENESS_NARROW_ROWS 6
#include "likeness/decode/avx2_impl.h"
#include "likeness/decode/int16_kernel_impl.h"

namespace likeness {
namespace {

bool Available() { return HasAvx2(); }

}  // namespace

extern const Kernel kKernel_avx2_int16;
const Kernel kKernel_avx2_int16 = {
    .name = "avx2-int16",
    .full_precision = false,
    .fixed_point = true,
    .element_bytes = 2,
    .bias_bytes = 2,
    .dense_bytes = 2,
    .available = Available,
    .enter = Enter,
    .leave = Leave,
    .weight_bytes = WeightBytes,
    .pack_weights = PackWeights,
    .pack_bias = PackBias,
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
