// A Live Link Face recording as a performance of an avatar.

#pragma once

#include "likeness/avatar/arkit_map.h"
#include "likeness/avatar/avatar.h"
#include "likeness/avatar/performance.h"
#include "likeness/simulate/live_link.h"

namespace likeness {

struct DriveOptions {
  int identity = 0;         // whose face, of an avatar of several people
  bool head_motion = true;  // turn the head as recorded; otherwise it stays upright
};

// Codes by the avatar's ARKit map; the head turns about its neck. An avatar with the condition "gaze" of simulated
// captures looks where the eyeLook coefficients say; other conditions stay at their means. Rows with the time of the
// row before are left out.
//   map  of ExpressionNames(), as ReadLiveLinkMap gives it
Performance PerformanceOf(const LiveLinkRecording& recording, const Avatar& avatar, const ArkitMap& map,
                          const DriveOptions& options = {});

// The avatar's ARKit map. Throws Error naming the file where it has none or one of other coefficients.
ArkitMap ReadLiveLinkMap(const SafetensorsFile& avatar_file, int latent);

}  // namespace likeness
