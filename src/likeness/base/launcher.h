// Which of several processes this is, as torchrun and Slurm tell it through the environment.

#pragma once

#include <string>

namespace likeness {

struct Launcher {
  int rank = 0;         // 0 ... count - 1
  int count = 1;        // processes in all
  int local_rank = 0;   // among those of this machine
  std::string address;  // of the first process, where the others find it
  int port = 0;
  bool has_store = false;  // torchrun's agent already listens at that port
};

// RANK, WORLD_SIZE, LOCAL_RANK, MASTER_ADDR and MASTER_PORT; under `srun`, SLURM_PROCID, SLURM_NTASKS and SLURM_LOCALID
// stand in for the first three where MASTER_ADDR is set. One process when nothing is set. Throws Error, naming the
// variable, for half of it and for numbers that make no sense.
Launcher ReadLauncher();

}  // namespace likeness
