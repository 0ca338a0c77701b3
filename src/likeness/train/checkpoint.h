// Checkpoints: all that a run needs to go on as if it had never stopped, in one safetensors file each.

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "likeness/train/network.h"

namespace likeness {

struct RunState {
  int64_t iteration = 0;         // steps done, skipped ones too
  int64_t batches = 0;           // of all processes
  double elapsed_s = 0;          // of training
  int64_t skipped = 0;           // steps whose loss or gradient was not finite
  int64_t skipped_in_a_row = 0;  // until now
};

// What a checkpoint must agree with before a run may go on from it.
struct RunIdentity {
  Architecture architecture;
  std::vector<std::string> fingerprint;  // TrainOptions::Fingerprint()
};

// The last few checkpoints of a run: OUT/checkpoints/ITERATION.safetensors. One process at a time.
class Checkpoints {
 public:
  //   keep  how many stay, 1 or more
  // Removes what a killed process left half-written.
  Checkpoints(const std::filesystem::path& out, int keep);

  // Newest first.
  std::vector<std::filesystem::path> Files() const;

  // Writes one whole or not at all, then removes the oldest beyond `keep`.
  //   tensors  float32 on any device
  void Save(const RunState& run, const RunIdentity& identity, const std::vector<Parameter>& tensors);

  // Fills the tensors from the newest checkpoint that is whole; damaged ones are passed over with a warning. None where
  // there are no checkpoints. Throws Error, naming the differences, when options or architecture are other ones, and
  // when all are damaged.
  std::optional<RunState> Load(const RunIdentity& identity, const std::vector<Parameter>& tensors) const;

  // The run starts afresh: the next Save removes all that are there now.
  void Replace() { replaced_ = Files(); }

 private:
  std::filesystem::path folder_;
  size_t keep_;
  std::vector<std::filesystem::path> replaced_;
};

}  // namespace likeness
