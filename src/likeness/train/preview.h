// What training's pictures in TensorBoard show.

#pragma once

#include <torch/types.h>

#include "likeness/image/image.h"
#include "likeness/train/dataset.h"
#include "likeness/train/network.h"

namespace likeness {

// Rows of truth, prediction and five-fold difference, for three samples spread over the capture; unseen texels are
// grey.
ImageU8 Preview(const Network& network, const Dataset& dataset, torch::Device device);

}  // namespace likeness
