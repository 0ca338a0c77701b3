// Captures of heads as Ava-256 and Goliath publish them.
//
// A folder, or its sub-folder `decoder`:
//   camera_calibration.json                             K and T transposed, for the whole sensor
//   frame_list.csv                                      Ava-256; Goliath: frame_splits_list.csv,
//   frame_segments_list.csv image/cam<id>.zip                                   cam<id>/<frame>.avif (or .png)
//   head_pose/head_pose.zip                             <frame>.txt, 3 x 4, head to world
//   kinematic_tracking/registration_vertices.zip        <frame>.ply
//   kinematic_tracking/registration_vertices_{mean.npy,variance.txt}
//   uv_image/color.zip, color_mean.png, color_variance.txt    average textures
//   segmentation_parts/cam<id>.zip                      classes of pixels
// Every zip may be unpacked, into a folder of its name or (poses and meshes) beside it. Nothing is written here, so the
// folder may be read-only; `likeness convert` makes a copy to unwrap and train on.

#pragma once

#include <filesystem>
#include <memory>

#include "likeness/capture/capture.h"

namespace likeness {

// Whether the folder, or `decoder` in it, has camera_calibration.json and a list of frames.
bool IsAva256(const std::filesystem::path& root);

// What is done about what differs from our conventions:
//   sensor and picture sizes     the pictures' headers give the size, the principal points tell which size K is for
//   (the
//                                sensor's 2668 x 4096, else the pictures' own); K is scaled, and said so when it is
//                                neither of the published 1/4 and 1/2
//   pixel centres                Ava-256's loader scales K as if the first pixel's centre were at (0.5, 0.5), as ours
//                                is; Goliath's as if it were at (0, 0): there half a pixel of the sensor is added
//   lens distortion              by options.distortion: an Error; undone whenever an image is read; or ignored, as the
//                                publishers' loaders do, with a warning that says by how many pixels that may be wrong
//   faces                        options.topology_file; else kinematic_tracking/template_mesh.obj (Goliath); else
//                                face_topology.obj in the folder or up to two above it (Ava-256's own is in its code)
//   missing frames and files     skipped_frames() and HasCameraImage() tell
//   masks                        classes hair, skin, lenses, lips, teeth and tongue are head; chair and clothes are not
//   split                        Goliath: frames of "test" are held out; Ava-256: none, unless options or split.json
std::unique_ptr<Capture> OpenAva256(const std::filesystem::path& root, const CaptureOptions& options);

}  // namespace likeness
