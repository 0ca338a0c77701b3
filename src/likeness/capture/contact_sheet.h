// One picture of a whole capture: cameras x frames, with the tracked mesh drawn over every image.

#pragma once

#include "likeness/capture/capture.h"
#include "likeness/image/image.h"

namespace likeness {

struct ContactSheetOptions {
  int cameras = 8;      // rows; evenly spread when the capture has more
  int frames = 6;       // columns; evenly spread over all segments
  int thumbnail = 240;  // px, the longer side of an image; 64 ... 1024
  bool mesh = true;     // draws the tracked mesh over the images

  void Check() const;  // throws Error
};

// Rows are cameras, columns frames. Held-out cameras and segments are labelled in another colour. What cannot be read
// is shown as an empty cell that says so.
ImageU8 DrawContactSheet(const Capture& capture, const ContactSheetOptions& options = {});

// The edges that the camera sees, as thin lines that grow fainter where the mesh is dense.
void DrawWireframe(ImageU8* picture, const Camera& camera, const TrackedFrame& tracked, const MeshTopology& topology);

// `count` of 0 ... size - 1, evenly spread, the first and last among them; all of them when there are no more.
std::vector<size_t> EvenlySpread(size_t size, size_t count);

}  // namespace likeness
