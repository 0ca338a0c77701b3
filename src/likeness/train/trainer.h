// Training: an unwrapped capture to an avatar file (Lombardi et al. 2018, section 4).

#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "likeness/train/options.h"

namespace likeness {

struct TrainResult {
  bool finished = false;         // false: stopped on request; a checkpoint says how far it came
  std::filesystem::path avatar;  // OUT/avatar.safetensors, once finished
  int64_t iterations = 0;        // steps done, earlier runs' too
  int64_t samples = 0;           // textures seen
  int64_t skipped = 0;           // steps left out because a value was not finite
  double elapsed_s = 0;          // of training, earlier runs' too
  double samples_per_s = 0;      // of this run
  double waiting = 0;            // share of this run's time spent waiting for the loader
  size_t cache_bytes = 0;        // textures in memory
  size_t cache_file_bytes = 0;   // and in the file of --cache-dir
  int64_t textures_made = 0;     // readings of the capture's files
  double loss = 0;               // means over the last logged steps
  double loss_texture = 0;
  double loss_geometry = 0;
  double loss_kl = 0;
  double loss_image = 0;
};

// Trains until the iterations or minutes are over, or until stop() says so. Writes into options.out:
//   avatar.safetensors      when finished
//   checkpoints/            every save_minutes, on request to stop, and at the end, the last few; the next run goes on
//                           from the newest that is whole
//   log.csv                 losses, gradient norm, learning rate every log_every iterations
//   train.toml              `resolved`, where it is given
//   tensorboard/            the same, and pictures of fixed samples: truth, prediction, difference
// On one machine's CPU with the same number of threads, a run limited by iterations gives the same weights bit for bit,
// stopped and resumed or not. Throws Error for wrong options, an incomplete capture, a checkpoint of other options, and
// when the loss stays not finite.
//   resolved  the options as TOML, written as train.toml once it is sure that the run begins or goes on; empty: none
TrainResult Train(const TrainOptions& options, const std::function<bool()>& stop, const std::string& resolved = "");

// Tells the C library to keep freed memory, in huge pages: training frees and takes hundreds of megabytes a step, and
// would spend up to a third of its time on page faults. For a process that trains and does little else; call it before
// the first tensor is made.
void KeepMemory();

}  // namespace likeness
