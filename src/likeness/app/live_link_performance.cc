#include "likeness/app/live_link_performance.h"

#include <algorithm>

#include "likeness/avatar/avatar_id.h"
#include "likeness/base/error.h"
#include "likeness/simulate/gaze_condition.h"

namespace likeness {

ArkitMap ReadLiveLinkMap(const SafetensorsFile& avatar_file, int latent) {
  const std::optional<ArkitMap> map = ReadArkitMap(avatar_file, latent);
  if (!map) {
    throw FileError(avatar_file.path(),
                    "has no map from ARKit coefficients to codes; likeness fit-arkit AVATAR CAPTURE makes one from a "
                    "capture whose frames have coefficients");
  }
  const auto& names = ExpressionNames();
  if (!std::equal(map->coefficients.begin(), map->coefficients.end(), names.begin(), names.end())) {
    throw FileError(avatar_file.path(),
                    "has an ARKit map of other coefficients than Live Link Face's 52; make it again with likeness "
                    "fit-arkit");
  }
  return *map;
}

Performance PerformanceOf(const LiveLinkRecording& recording, const Avatar& avatar, const ArkitMap& map,
                          const DriveOptions& options) {
  Performance performance;
  performance.avatar = AvatarId(avatar);
  performance.person = avatar.identities[static_cast<size_t>(options.identity)].name;
  performance.latent = avatar.architecture.latent;
  const std::vector<NamedCondition> gaze = {{"gaze", static_cast<int>(kGazeColumns.size())}};
  if (avatar.architecture.conditions == gaze) performance.conditions = gaze;
  for (const PerformanceFrame& frame : recording.frames) {
    if (!performance.seconds.empty() && frame.time_s <= performance.seconds.back()) continue;
    performance.seconds.push_back(frame.time_s);
    const std::vector<float> code = map.CodeOf(frame.weights);
    performance.codes.insert(performance.codes.end(), code.begin(), code.end());
    performance.world_from_head.push_back(options.head_motion ? frame.WorldFromHead() : RigidTransform());
    if (performance.conditions.empty()) continue;
    const auto directions = GazeDirections(frame.weights);
    performance.condition_values.insert(performance.condition_values.end(), directions.begin(), directions.end());
  }
  performance.Check("the performance of the recording");
  return performance;
}

}  // namespace likeness
