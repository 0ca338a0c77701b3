// Checkpoints: all that a run needs to go on as if it had never stopped, in one safetensors file.

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "likeness/train/network.h"

namespace likeness {

struct RunState {
  int64_t iteration = 0;         // steps done, skipped ones too
  double elapsed_s = 0;          // of training
  int64_t skipped = 0;           // steps whose loss or gradient was not finite
  int64_t skipped_in_a_row = 0;  // until now
};

// Writes the file whole or not at all.
//   fingerprint  TrainOptions::Fingerprint()
//   tensors      float32 on any device
void SaveCheckpoint(const std::filesystem::path& path, const RunState& run, const Architecture& architecture,
                    const std::vector<std::string>& fingerprint, const std::vector<Parameter>& tensors);

// Fills the tensors. Throws Error naming the file when it is no checkpoint or damaged, and, naming the differences,
// when options or architecture are other ones.
RunState LoadCheckpoint(const std::filesystem::path& path, const Architecture& architecture,
                        const std::vector<std::string>& fingerprint, const std::vector<Parameter>& tensors);

}  // namespace likeness
