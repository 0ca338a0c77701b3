#define LIKENESS_VECTOR_BYTES 64
#define LIKENESS_TILE 24
#include "likeness/train/ops/row_kernels_impl.h"

namespace likeness {

extern const RowKernels kRowKernels_avx512;
const RowKernels kRowKernels_avx512 = {"avx512",    4,        1,         kLanes,       false, 4,
                                       PackWeights, Multiply, Correlate, ScratchBytes, Load,  LoadGradient,
                                       Split,       Store,    Copy};

}  // namespace likeness
