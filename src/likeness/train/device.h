// Where tensors live: the one place that turns --device into LibTorch's device.

#pragma once

#include <torch/types.h>

#include <string>

namespace likeness {

// "cpu", or "cuda" or "cuda:N" where LibTorch finds such a GPU; "cuda" is the GPU number `local_rank`, so that the
// processes of one machine share them out. Throws Error otherwise, saying what there is.
torch::Device FindDevice(const std::string& name, int local_rank = 0);

}  // namespace likeness
