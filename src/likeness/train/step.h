// One step of training.

#pragma once

#include <cstdint>

#include "likeness/train/dataset.h"
#include "likeness/train/network.h"
#include "likeness/train/optimiser.h"
#include "likeness/train/options.h"

namespace likeness {

struct StepValues {
  double total = 0, texture = 0, geometry = 0, kl = 0;
  double gradient_norm = 0;
  bool skipped = false;  // a value was not finite: nothing was changed
};

// Encodes the batch's frames, samples codes z = mu + sigma * noise, decodes, and moves the weights against the loss's
// gradient. The noise is a function of `noise_seed` alone.
StepValues TrainStep(const Network& network, Optimiser& optimiser, const Batch& batch, const LossWeights& weights,
                     uint64_t noise_seed, double learning_rate, double clip);

}  // namespace likeness
