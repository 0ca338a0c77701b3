// Frames of a capture as a performance of the avatar: the encoder's mean codes, head poses, times, named conditions.

#pragma once

#include <vector>

#include "likeness/avatar/performance.h"
#include "likeness/texture/texture_set.h"
#include "likeness/train/model.h"

namespace likeness {

// Shows progress. Throws Error naming the file where a texture, a mesh or a condition is absent or wrong, and when
// there is no frame.
//   textures           of the avatar's size
//   frames             in the capture's order
//   identity           the avatar's person whom the capture shows
//   frames_per_second  at which the frames' numbers count (FrameTimes)
Performance EncodeFrames(const AvatarModel& model, const TextureSet& textures, const std::vector<FrameId>& frames,
                         int identity, double frames_per_second);

}  // namespace likeness
