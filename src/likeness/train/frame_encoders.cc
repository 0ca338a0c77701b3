#include "likeness/train/frame_encoders.h"

#include <fmt/format.h>

#include "likeness/base/error.h"
#include "likeness/capture/condition_file.h"

namespace likeness {

FrameEncoder OwnFrames(const AvatarModel& model, const TextureSet& textures, int identity) {
  std::vector<ConditionFile> files;
  for (const NamedCondition& condition : model.avatar().architecture.conditions) {
    const ConditionFile& file = files.emplace_back(textures.capture().root(), condition.name);
    if (file.size() != condition.size) {
      throw FileError(file.path(),
                      fmt::format("has {} values a frame; the avatar has {}", file.size(), condition.size));
    }
  }
  return [&model, &textures, identity, files](const FrameId& frame, const TrackedFrame& tracked) {
    FrameConditions conditions;
    conditions.identity = identity;
    for (const ConditionFile& file : files) {
      const std::vector<float>& values = file.Of(frame);
      conditions.values.insert(conditions.values.end(), values.begin(), values.end());
    }
    const std::vector<float> code =
        model.Encode(textures.ReadAverage(frame), tracked.vertices_in_head, /*seen=*/{}, conditions);
    return EncodedFrame{code, conditions};
  };
}

FrameEncoder PerformedFrames(const AvatarModel& model, const TextureSet& performer, int performer_identity, int shown) {
  return [&performer, shown, encode = OwnFrames(model, performer, performer_identity)](const FrameId& frame,
                                                                                       const TrackedFrame&) {
    EncodedFrame encoded = encode(frame, performer.capture().ReadTracked(frame));
    encoded.conditions.identity = shown;
    return encoded;
  };
}

}  // namespace likeness
