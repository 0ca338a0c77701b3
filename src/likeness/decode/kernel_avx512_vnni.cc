// 16-bit fixed-point features and weights on AVX-512 with VNNI, whose instruction multiplies pairs and adds them to
// sums.

#include <immintrin.h>

#define LIKENESS_VECTOR_BYTES 64
#define LIKENESS_HALF
#define LIKENESS_NARROW_ROWS 12
#define LIKENESS_VNNI
#include "likeness/decode/avx512_impl.h"
#include "likeness/decode/int16_kernel_impl.h"

namespace likeness {
namespace {

bool Available() { return HasAvx512() && __builtin_cpu_supports("avx512vnni"); }

}  // namespace

extern const Kernel kKernel_avx512_vnni;
const Kernel kKernel_avx512_vnni = {
    .name = "avx512-vnni",
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
