// The colours of the procedural head.

#pragma once

#include "likeness/image/image.h"

namespace likeness {

// The atlas of the tracked mesh: skin with mottling at several scales, lips, brows, painted eyes on the lid patches, a
// dark red mouth. RGB, sRGB-encoded, size x size; row 0 is v = 1.
ImageU8 PaintProceduralSkin(int size, uint64_t seed);

// RGB, sRGB-encoded; u runs around the line of sight, v from the back (0) to the pupil (1).
ImageU8 PaintProceduralEye(int size, uint64_t seed);

}  // namespace likeness
