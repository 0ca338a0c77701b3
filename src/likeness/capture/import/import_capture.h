// Makes a capture in our layout from another tool's calibration and files that lie about: undistorted images, KRT,
// masks of valid pixels, and head masks, tracked meshes and head poses where there are any.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "likeness/capture/capture.h"

namespace likeness {

// A pattern is a path with {segment}, {camera} and {frame} in it (import/file_pattern.h); "" means none.
struct ImportOptions {
  std::string kind;                 // of the calibration (import/read_calibration.h)
  std::filesystem::path source;     // of the calibration
  std::filesystem::path out;        // folder of the capture
  std::string unit = "mm";          // of the calibration: m, cm, mm or inch
  double scale = 1;                 // multiplies it further, for calibrations without a unit
  bool fisheye = false;             // OpenCV files that do not say so hold fisheyes
  double shrink = 1;                // images become this much smaller
  std::string images;               // pattern; "": those that the calibration names, as one frame
  std::string masks;                // pattern of head masks, white = head; "": as the calibration names them
  std::string meshes;               // pattern of .obj or .bin
  std::string poses;                // pattern of head poses, 3 x 4 [R | t] head to world, in the meshes' unit
  std::filesystem::path topology;   // .obj with faces and UVs; "": the first mesh that is an .obj
  std::string mesh_space = "head";  // or "world": head poses are found by aligning each mesh with the first
  std::string mesh_unit = "same";   // of meshes and poses: as the calibration's with its scale, or m, cm, mm, inch
  std::string up;                   // of the head in the first frame, in the world: "x,y,z"; "": the mean camera's

  void Check() const;  // throws Error
};

struct ImportResult {
  int cameras = 0;
  int frames = 0;
  int images_written = 0;            // undistorted or converted
  int images_copied = 0;             // byte for byte
  int images_kept = 0;               // by an earlier run
  int images_absent = 0;             // of a camera in a frame
  int meshes = 0;                    // frames with one
  int valid_masks = 0;               // cameras with pixels that are not valid
  double distance_to_focus_mm = 0;   // median, of cameras from where they look
  std::vector<std::string> remarks;  // what is missing or odd and what to do, one sentence each
};

// Lengths become millimetres: length * unit * scale. Meshes in world space: the first frame's head has its origin at
// the mean of its vertices, y along `up`, z towards the mean camera centre as far as that is at right angles to y, and
// x = y cross z, to the subject's left; every later frame's pose is the rigid transform that brings the first frame's
// vertices nearest to its own (Kabsch), so a rigid part of an expression counts as head motion.
//
// Uses all threads. Finished images of an earlier run with the same options are kept; on Ctrl-C it ends by an Error
// that says how to go on. Throws Error when `out` was made with other options, and for anything wrong in the sources.
ImportResult ImportCapture(const ImportOptions& options);

}  // namespace likeness
