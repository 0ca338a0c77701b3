// Unwraps a whole capture into the layout's folders.

#pragma once

#include <cstdint>
#include <vector>

#include "likeness/base/launcher.h"
#include "likeness/capture/capture.h"
#include "likeness/texture/unwrap.h"

namespace likeness {

struct UnwrapReport {
  int64_t views = 0;           // unwrapped now
  int64_t views_kept = 0;      // done by an earlier run
  int64_t views_absent = 0;    // cameras without an image of a frame
  int64_t training_views = 0;  // in the statistics
  // Shards that have not finished; while there are any, there are no statistics and the variances are 0.
  std::vector<int> shards_missing;
  double texture_variance = 0;
  double vertex_variance = 0;
};

// For every frame and camera with an image: unwrapped_uv_<size>/<segment>/<camera>/<frame>.png and its mask in
// unwrapped_mask_<size>; for every frame the average over the training cameras; then, over training cameras and
// training segments, tex_mean.png, tex_var.txt, vert_mean.bin and vert_var.txt in unwrapped_uv_<size>, and in the root
// too unless that would replace those of another size which exist nowhere else, or of a larger one. Held-out cameras
// and segments enter neither averages nor statistics of training. Pixels that a camera's valid mask excludes give no
// colour.
//
// Uses all cores. Files that an earlier run finished are kept, and their sums read back, so the result does not depend
// on how often it was interrupted. On Ctrl-C it ends after the views it is at, by an Error that says how to go on.
// Also throws Error when textures of this size exist that were made with other options or by another program, unless
// options.redo, which removes them.
//
// A shard makes its own frames' textures and averages and leaves their sums, as a file, to whichever shard is the last:
// that one writes the statistics. All files are the same, bit for bit, for any number of shards. A shard that was
// interrupted or lost runs again, with the same number of shards or another.
UnwrapReport UnwrapCapture(const Capture& capture, const UnwrapOptions& options, const Shard& shard = {});

}  // namespace likeness
