// Two eyes from one camera.

#pragma once

#include "likeness/geometry/camera.h"

namespace likeness {

// The camera moved along its own x axis by `offset_mm` (the left eye's is negative), still looking straight ahead, its
// picture shifted so that what is `distance_mm` before the middle camera stays where it was: both eyes rest on it.
inline Camera EyeCamera(const Camera& middle, double offset_mm, double distance_mm) {
  Camera eye = middle;
  eye.cam_from_world.translation.x() -= offset_mm;
  eye.intrinsics(0, 2) += middle.intrinsics(0, 0) * offset_mm / distance_mm;
  return eye;
}

}  // namespace likeness
