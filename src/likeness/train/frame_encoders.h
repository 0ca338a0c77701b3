// Frames of captures as evaluation decodes them: in a person's own face, or in another's.

#pragma once

#include "likeness/texture/texture_set.h"
#include "likeness/train/evaluate.h"
#include "likeness/train/model.h"

namespace likeness {

// Encodes frames of a capture, with their named conditions; decoded, they show the person who gave them. Model and
// textures are borrowed. Throws Error, naming the file, where a condition of the avatar is absent or has another size.
//   identity  the avatar's person whom the capture shows
FrameEncoder OwnFrames(const AvatarModel& model, const TextureSet& textures, int identity);

// Encodes the frame of the same name in the performer's capture in place of the frame itself, to be decoded as `shown`:
// what is left of an expression in another's face, where both gave the same performance.
FrameEncoder PerformedFrames(const AvatarModel& model, const TextureSet& performer, int performer_identity, int shown);

}  // namespace likeness
