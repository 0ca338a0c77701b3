// Makes a capture with known truth: a head performs in front of a rig of cameras under even light.
//
// Written in the Multiface layout (capture/writer.h), with masks of head pixels and a split of cameras and segments.
// The folder truth/ of the capture holds what was put in:
//   performance.csv   a row a frame: segment, frame, time, head pose (row-major [R | t], mm), 52 weights
//   neutral.obj       the tracked mesh at rest
//   lights.csv        direction in the world, irradiance
//   head.toml         the recipe of a human head
//   options.json      what the pictures depend on; a later run continues only with the same

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "likeness/simulate/renderer.h"
#include "likeness/simulate/rig.h"

namespace likeness {

struct SimulateOptions {
  std::filesystem::path out;
  std::string head = "human:1";       // as OpenHead takes it
  std::filesystem::path head_data;    // MakeHuman data; empty: searched
  std::filesystem::path shape_map;    // names a GLB head's morph targets; empty: their ARKit names
  std::filesystem::path performance;  // a Live Link Face CSV; empty: built-in
  int frames = 48;                    // over all segments, 2 or more
  RigOptions rig;
  ShadingOptions render;
  int lights = 200;
  float exposure = 0.75f;  // linear value of a white surface that faces forwards, in the open
  uint64_t seed = 1;       // of motion

  void Check() const;  // throws Error
};

struct SimulateResult {
  int cameras = 0;
  int segments = 0;
  int frames = 0;
  int images_written = 0;
  int images_kept = 0;  // from an earlier run
};

// Uses all threads, holds one frame in memory, and continues where an earlier run with the same options stopped. Throws
// Error when `out` holds a capture made with other options, and says which differ. Images are the same for any number
// of threads.
SimulateResult Simulate(const SimulateOptions& options);

}  // namespace likeness
