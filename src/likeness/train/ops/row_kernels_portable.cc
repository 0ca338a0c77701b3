#define LIKENESS_VECTOR_BYTES 16
#define LIKENESS_TILE 8
#include "likeness/train/ops/row_kernels_impl.h"

namespace likeness {

extern const RowKernels kRowKernels_portable;
const RowKernels kRowKernels_portable = {"portable",  4,        1,         kLanes,       false, 4,
                                         PackWeights, Multiply, Correlate, ScratchBytes, Load,  LoadGradient,
                                         Split,       Store,    Copy};

}  // namespace likeness
