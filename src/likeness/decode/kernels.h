// The kernels that there are, and those that this processor can run.

#pragma once

#include <string>
#include <vector>

#include "likeness/decode/kernel.h"

namespace likeness {

// From the fastest to the plainest; the last, "portable", runs everywhere.
const std::vector<const Kernel*>& AllKernels();
std::vector<const Kernel*> AvailableKernels();

// Throws Error, naming what there is, for a kernel that is unknown or that this processor cannot run.
const Kernel& FindKernel(const std::string& name);

}  // namespace likeness
