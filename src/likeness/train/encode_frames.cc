#include "likeness/train/encode_frames.h"

#include "likeness/avatar/avatar_id.h"
#include "likeness/base/error.h"
#include "likeness/base/progress.h"
#include "likeness/capture/frame_times.h"
#include "likeness/train/frame_encoders.h"

namespace likeness {

Performance EncodeFrames(const AvatarModel& model, const TextureSet& textures, const std::vector<FrameId>& frames,
                         int identity, double frames_per_second) {
  const Avatar& avatar = model.avatar();
  Performance performance;
  performance.avatar = AvatarId(avatar);
  performance.person = avatar.identities[static_cast<size_t>(identity)].name;
  performance.latent = avatar.architecture.latent;
  performance.conditions = avatar.architecture.conditions;
  performance.seconds = FrameTimes(frames, frames_per_second);
  const FrameEncoder encode = OwnFrames(model, textures, identity);
  Progress progress("encode", static_cast<int64_t>(frames.size()), "frames");
  for (const FrameId& frame : frames) {
    const TrackedFrame tracked = textures.capture().ReadTracked(frame);
    const EncodedFrame encoded = encode(frame, tracked);
    performance.codes.insert(performance.codes.end(), encoded.code.begin(), encoded.code.end());
    performance.condition_values.insert(performance.condition_values.end(), encoded.conditions.values.begin(),
                                        encoded.conditions.values.end());
    performance.world_from_head.push_back(tracked.world_from_head);
    performance.frame_names.push_back(frame.segment + "/" + frame.frame);
    progress.Advance();
  }
  performance.Check(textures.capture().root().string());
  return performance;
}

}  // namespace likeness
