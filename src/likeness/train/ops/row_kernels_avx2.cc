#define LIKENESS_VECTOR_BYTES 32
#define LIKENESS_TILE 12
#include "likeness/train/ops/row_kernels_impl.h"

namespace likeness {

extern const RowKernels kRowKernels_avx2;
const RowKernels kRowKernels_avx2 = {"avx2",      4,        1,         kLanes,       false, 4,
                                     PackWeights, Multiply, Correlate, ScratchBytes, Load,  LoadGradient,
                                     Split,       Store,    Copy};

}  // namespace likeness
