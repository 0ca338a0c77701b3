// One step of training.

#pragma once

#include <cstdint>

#include "likeness/train/dataset.h"
#include "likeness/train/gradient_exchange.h"
#include "likeness/train/image_loss.h"
#include "likeness/train/network.h"
#include "likeness/train/optimiser.h"
#include "likeness/train/options.h"
#include "likeness/train/peers.h"

namespace likeness {

struct StepValues {
  double total = 0, texture = 0, geometry = 0, kl = 0, image = 0;
  double gradient_norm = 0;
  bool skipped = false;  // a value was not finite: nothing was changed
};

// Encodes the batch's frames, samples codes z = mu + sigma * noise, decodes, and moves the weights against the loss's
// gradient. The noise is a function of `noise_seed` alone. With peers, each has a batch of its own, as if the step's
// whole batch was cut in pieces: values and gradients are the means over all, and everybody takes the same step.
//   image_loss  null: without this term
StepValues TrainStep(const Network& network, Optimiser& optimiser, const Peers& peers, GradientExchange& exchange,
                     const Batch& batch, const LossWeights& weights, const ImageLoss* image_loss, uint64_t noise_seed,
                     double learning_rate, double clip);

}  // namespace likeness
