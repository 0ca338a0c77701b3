// --shard i/n: the part of a work that is this process's.

#pragma once

#include <string>

#include "likeness/app/command.h"
#include "likeness/base/launcher.h"

namespace likeness {

// --shard; `text` must outlive the parsing.
void AddShardFlag(Command* command, std::string* text, const std::string& help);

// What the flag says; where it is empty, what torchrun's or Slurm's variables say. Empties the text, so that all shards
// record the same options. Throws UsageError for anything but i/n.
Shard TakeShard(std::string* text);

}  // namespace likeness
