// Which of several processes this is, as torchrun and Slurm tell it through the environment.

#pragma once

#include <cstdint>
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

// One of several parts of a list of frames: the items index - 1, index - 1 + count, ...
struct Shard {
  int index = 1;  // 1 ... count
  int count = 1;

  bool Has(int64_t item) const { return item % count == index - 1; }
};

// The part of this process, for work whose processes need not talk to each other: as ReadLauncher, but MASTER_ADDR and
// MASTER_PORT may be absent, under `srun` too.
Shard ReadLauncherShard();

}  // namespace likeness
