// Makes a capture with known truth: a head performs in front of a rig of cameras under even light.
//
// Written in the Multiface layout (capture/writer.h), with masks of head pixels and a split of cameras and segments.
// The folder truth/ of the capture holds what was put in:
//   performance.csv   a row a frame: segment, frame, time, head pose (row-major [R | t], mm), 52 weights
//   neutral.obj       the tracked mesh at rest
//   lights.csv        direction in the world, irradiance
//   head.toml         the recipe of a human head
//   options.json      what the files depend on; a later run continues only with the same
// and, where imperfections make the capture differ from it:
//   KRT               the true calibration
//   tracked_mesh/     the true meshes and head poses, as in the capture
//   imperfections.json  gains and biases of cameras, exposures of frames

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "likeness/simulate/imperfections.h"
#include "likeness/simulate/open_head.h"
#include "likeness/simulate/renderer.h"
#include "likeness/simulate/rig.h"

namespace likeness {

enum class Script {
  kShort,  // BuiltInPerformance: of any length
  kFull,   // FullPerformance: 122 peak expressions, 50 sentences
};

struct SimulateOptions {
  std::filesystem::path out;
  std::string head = "human:7";       // as OpenHead takes it
  std::filesystem::path head_data;    // MakeHuman data; empty: searched
  std::filesystem::path shape_map;    // names a GLB head's morph targets; empty: their ARKit names
  std::filesystem::path performance;  // a Live Link Face CSV; empty: built-in
  Script script = Script::kShort;     // of the built-in performance
  int frames = 42;                    // over all segments, 2 or more
  RigOptions rig;
  ShadingOptions render;
  int lights = 200;
  float exposure = 0.75f;  // linear value of a white surface that faces forwards, in the open
  uint64_t seed = 1;       // of motion and imperfections
  ImperfectionOptions imperfections;
  // This run makes frames shard - 1, shard - 1 + shards, ... of the list; the files of the whole capture are written by
  // every one of them, alike.
  int shard = 1, shards = 1;

  void Check() const;  // throws Error
};

// Options by name: "demo" (the defaults; what scripts/demo uses), "small" (for quick tries), "paper" (the published
// method's capture: 40 cameras of which 8 are held out, 50 mm lenses at a metre, 5120 x 3840 pixels, 200 lights, the
// full performance). Throws Error for other names.
SimulateOptions SimulatePreset(const std::string& name);

struct SimulateResult {
  int cameras = 0;
  int segments = 0;
  int frames = 0;
  int images_written = 0;
  int images_kept = 0;  // from an earlier run; of this shard's
};

// Uses all threads, holds one frame in memory, and continues where an earlier run with the same options stopped. Throws
// Error when `out` holds a capture made with other options, and says which differ. Images are the same for any number
// of threads and shards. Images of many pixels are made one after another, so that memory stays within about ten bytes
// for each pixel of one image, or a gigabyte.
SimulateResult Simulate(const SimulateOptions& options);

// The same for a head and a rig at hand; `options` says what the head is called. The rig is recorded by its options
// and `rig_for`, which names the heads that it was made for.
SimulateResult SimulateHead(const SimulateOptions& options, const OpenedHead& opened, const Rig& rig,
                            const std::string& rig_for);

}  // namespace likeness
