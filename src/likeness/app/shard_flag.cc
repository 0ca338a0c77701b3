#include "likeness/app/shard_flag.h"

#include <fmt/format.h>

#include <cstdio>

namespace likeness {

void AddShardFlag(Command* command, std::string* text, const std::string& help) {
  command->Option("shard", text, "i/n: " + help + "; default: as torchrun or srun says");
}

Shard TakeShard(std::string* text) {
  if (text->empty()) return ReadLauncherShard();
  Shard shard;
  int used = 0;
  if (std::sscanf(text->c_str(), "%d/%d%n", &shard.index, &shard.count, &used) != 2 ||
      used != static_cast<int>(text->size()) || shard.index < 1 || shard.index > shard.count) {
    throw UsageError(fmt::format("--shard {}: expected i/n with i from 1 to n, such as 2/8", *text));
  }
  text->clear();
  return shard;
}

}  // namespace likeness
