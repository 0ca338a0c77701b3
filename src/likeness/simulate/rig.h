// The cameras of a simulated capture.

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "likeness/geometry/camera.h"
#include "likeness/geometry/mesh.h"

namespace likeness {

struct RigOptions {
  int cameras = 14;          // in all
  int held_out_cameras = 3;  // of them
  int width = 512;           // px
  int height = 768;          // px
  double distance_mm = 1000;
  // Focal length as on a 36 x 24 mm sensor, compared by the diagonal: focal_px = lens_mm / 43.27 mm x the image's
  // diagonal in pixels. 0: the longest lens that the head leaves room for.
  double lens_mm = 0;
  // The part of the frontal hemisphere that the cameras look from, degrees.
  double most_azimuth = 80;
  double lowest_elevation = -28;
  double highest_elevation = 42;

  void Check() const;  // throws Error
};

struct Rig {
  std::vector<Camera> cameras;        // "cam00", "cam01", ... from the subject's right to the left
  std::vector<std::string> held_out;  // names; they lie among the others, not at the border
};

// Cameras spread evenly over the part (the means of equal areas, Lloyd 1982), all with the same long lens and looking
// at the middle of `head_in_world` (of several heads, where they share a rig). Without a lens length the largest one of
// the views fills 84% of its image's height or width, which leaves room for head motion; throws Error when a given one
// leaves less than a third of that room.
Rig MakeRig(const RigOptions& options, const Vertices& head_in_world);

}  // namespace likeness
