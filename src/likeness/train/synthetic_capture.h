// A small unwrapped capture with a known law, written for tests in milliseconds: textures that depend on the frame's
// state and on the view, a mesh that depends on the state, texels that side cameras do not see, and
// conditions/gaze.csv.

#pragma once

#include <filesystem>

namespace likeness {

struct SyntheticCapture {
  int size = 16;  // texels a side
  int cameras = 4;
  int held_out_cameras = 1;  // of these, the last ones
  int frames = 6;            // in segment "a"; segment "held" has two more, held out
  int grid = 4;              // vertices a side of the mesh
  int picture = 0;  // pixels a side of camera images, with head masks, drawn from mesh and textures; 0: there are none
  float tracking_error_mm = 0;  // tracked vertices lie so far to the left of where the pictures show them
  // Who it is: people give the same performance with another face at rest (mesh and texture), and move it otherwise.
  int person = 0;

  void Write(const std::filesystem::path& root) const;
};

}  // namespace likeness
