// The camera images of the image loss: which pixels count, and crops of them.

#pragma once

#include <cstdint>

#include "likeness/capture/capture.h"
#include "likeness/image/image.h"

namespace likeness {

// What an image of a training camera shows of the head.
struct HeadImage {
  ImageU8 colour;  // RGB
  ImageU8 head;    // 255 where a pixel counts, else 0
};

// The paper's m: the capture's own mask, binarised. Where it has none, what the tracked mesh covers, without what is
// background by its colour where the image's borders share one, such as black. Without what the camera never shows.
// Throws Error when the image is absent.
HeadImage ReadHeadImage(const Capture& capture, const FrameId& frame, const Camera& camera,
                        const TrackedFrame& tracked);

// A part of an image whose first pixel is (x0, y0); it may reach beyond the image, where nothing counts.
struct ImageCrop {
  int x0 = 0, y0 = 0;
  HeadImage pixels;
};

// width x height pixels about one that counts, each of these with the same chance, moved into the image as far as it
// goes. About the image's middle where no pixel counts.
ImageCrop CropAtRandom(const HeadImage& image, int width, int height, uint64_t seed);

}  // namespace likeness
