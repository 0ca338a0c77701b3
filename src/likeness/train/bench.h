// How fast training is on this machine: what `likeness bench train` measures.

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "likeness/train/options.h"

namespace likeness {

struct TrainBenchOptions {
  TrainOptions train;       // preset, batch, views, precision; size 0 is 512 without a capture
  int vertex_count = 7306;  // of the synthetic mesh
  int steps = 10;           // measured, after two that warm up
  bool layers = false;      // measure each layer on its own too
  bool on_capture = false;  // read train.capture, instead of random batches that lie in memory

  // Throws Error naming the option.
  void Check() const;
};

struct LayerTime {
  std::string name;
  double forward_ms = 0, backward_ms = 0;  // of a batch
  double gflop = 0;                        // both together
};

struct TrainBenchResult {
  Architecture architecture;
  int64_t parameters = 0;
  std::string kernels;  // that the convolutions ran on
  int threads = 0;
  double step_ms = 0;                        // median
  double step_ms_low = 0, step_ms_high = 0;  // quartiles
  double processor_ms = 0;                   // median of a step's processor time, all threads
  double samples_per_s = 0;                  // batch / median step, waiting included
  double waiting = 0;                        // share of the time that the network waited for the loader
  double memory_peak_mb = 0;                 // resident
  double gflop_per_sample = 0;               // products and sums of the layers, forward and backward
  double peak_gflops = 0;                    // a large float32 matrix product on this machine, just before
  double share_of_peak = 0;                  // above 1 where bfloat16 matrix units do the work
  std::vector<LayerTime> layers;
};

// Runs training steps as Train() does, on batches of random values or of the capture, and times them.
TrainBenchResult BenchTrain(const TrainBenchOptions& options);

}  // namespace likeness
