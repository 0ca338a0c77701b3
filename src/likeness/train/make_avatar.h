// A trained network to an avatar.

#pragma once

#include <torch/types.h>

#include "likeness/avatar/avatar.h"
#include "likeness/train/checkpoint.h"
#include "likeness/train/dataset.h"
#include "likeness/train/network.h"
#include "likeness/train/options.h"
#include "likeness/train/people.h"

namespace likeness {

// Lets the running statistics of batch normalisation follow weights that they were not met with, such as mean ones.
void RefreshStatistics(const Network& network, const Dataset& dataset, const TrainOptions& options,
                       torch::Device device);

// With the codes of all training frames, and how it was made.
Avatar MakeAvatar(const Network& network, const Dataset& dataset, const People& people, const TrainOptions& options,
                  const RunState& run, torch::Device device);

}  // namespace likeness
