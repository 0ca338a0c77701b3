#include "likeness/base/launcher.h"

#include <charconv>
#include <cstdlib>
#include <string_view>

#include "likeness/base/error.h"

namespace likeness {
namespace {

std::string_view Variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

int Number(const char* name, int least, int most) {
  const std::string_view text = Variable(name);
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < least || value > most) {
    throw Error("the variable {} is '{}'; expected a whole number from {} to {}, as torchrun and Slurm set it", name,
                text, least, most);
  }
  return value;
}

// Rank and count alone; false where no launcher speaks.
bool ReadRank(bool slurm, Launcher* launcher) {
  constexpr int kMostProcesses = 1 << 20;
  const bool torchrun = !Variable("WORLD_SIZE").empty() || !Variable("RANK").empty();
  if (!torchrun && !slurm) return false;
  launcher->count = Number(torchrun ? "WORLD_SIZE" : "SLURM_NTASKS", 1, kMostProcesses);
  launcher->rank = Number(torchrun ? "RANK" : "SLURM_PROCID", 0, launcher->count - 1);
  const char* local = torchrun ? "LOCAL_RANK" : "SLURM_LOCALID";
  if (!Variable(local).empty()) launcher->local_rank = Number(local, 0, kMostProcesses);
  return true;
}

// A batch script has the other variables too, but is no step of its own.
bool IsSlurmStep() {
  return !Variable("SLURM_STEP_ID").empty() && !Variable("SLURM_PROCID").empty() && !Variable("SLURM_NTASKS").empty();
}

}  // namespace

Launcher ReadLauncher() {
  Launcher launcher;
  if (!ReadRank(IsSlurmStep() && !Variable("MASTER_ADDR").empty(), &launcher)) return launcher;
  if (launcher.count == 1) return launcher;
  launcher.address = Variable("MASTER_ADDR");
  if (launcher.address.empty()) {
    throw Error("there are {} processes, but the variable MASTER_ADDR does not say where the first one is",
                launcher.count);
  }
  launcher.port = Number("MASTER_PORT", 1, 65535);
  launcher.has_store = Variable("TORCHELASTIC_USE_AGENT_STORE") == "True";
  return launcher;
}

Shard ReadLauncherShard() {
  Launcher launcher;
  ReadRank(IsSlurmStep(), &launcher);
  return {launcher.rank + 1, launcher.count};
}

}  // namespace likeness
