// The frame renderer's kernels that there are, and those that this processor can run.

#pragma once

#include <string>
#include <vector>

#include "likeness/render/raster_kernel.h"

namespace likeness {

// Those that this processor can run, from the fastest to the plainest; the last, "portable", runs everywhere.
std::vector<const RasterKernel*> AvailableRasterKernels();

// "auto" is the fastest. Throws Error, naming what there is, for a kernel that is unknown or cannot run here.
const RasterKernel& FindRasterKernel(const std::string& name);

}  // namespace likeness
