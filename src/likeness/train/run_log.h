// What a run leaves to be watched: log.csv and TensorBoard events.

#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>

#include "likeness/image/image.h"
#include "likeness/train/checkpoint.h"
#include "likeness/train/step.h"
#include "likeness/train/tensorboard.h"

namespace likeness {

// Rows hold means over the steps since the last row.
class RunLog {
 public:
  // Goes on with OUT/log.csv after iteration `first`: later rows, of steps that will be done again, are dropped. Starts
  // it anew with `first` 0.
  RunLog(const std::filesystem::path& out, int64_t first);

  void Add(const StepValues& values, double learning_rate);
  // Means since the last row. Skipped steps do not count.
  StepValues Means() const;
  // Means of the last row; those of an earlier run's last row until one is written.
  const StepValues& LastMeans() const { return last_; }

  void Write(const RunState& run);
  void WritePicture(const RunState& run, const ImageU8& picture);

 private:
  std::filesystem::path path_;
  std::ofstream csv_;
  TensorBoardWriter tensorboard_;
  StepValues sums_;
  int64_t counted_ = 0;
  double learning_rate_ = 0;
  StepValues last_;
};

}  // namespace likeness
