// Heads by name, as the command line gives them.

#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "likeness/simulate/head.h"

namespace likeness {

// What makes a head the same again: the pictures of two heads with equal text are equal.
struct OpenedHead {
  std::unique_ptr<Head> head;
  std::string recipe;  // TOML; empty for heads without one
};

//   spec  "human:SEED" or "human:FILE.toml" (see human/human_head.h), "FILE.glb" or "FILE.gltf" (see glb/glb_head.h),
//         "procedural", "procedural:SEED", or "plain": the procedural head whose scene is the tracked mesh alone
//   head_data  MakeHuman data for human heads; when empty: $LIKENESS_HEAD_DATA, then .deps/head-data here, then
//              ../share/likeness/head-data and ../../.deps/head-data from the program
//   shape_map  JSON that names a model's morph targets, for FILE.glb; empty for none
// Throws Error that says how to get the data where there are none.
OpenedHead OpenHead(const std::string& spec, const std::filesystem::path& head_data,
                    const std::filesystem::path& shape_map = {});

// The folder that OpenHead would take MakeHuman data from. Throws Error where there is none.
std::filesystem::path FindHeadData(const std::filesystem::path& given);

}  // namespace likeness
