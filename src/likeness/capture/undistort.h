// From the image of a real lens to that of the pinhole that every later stage assumes.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "likeness/geometry/camera.h"
#include "likeness/geometry/lens.h"
#include "likeness/image/image.h"

namespace likeness {

// A camera as calibrations describe it: K takes the distorted position to pixels, whose centres are at + 0.5.
struct DistortedCamera {
  Camera camera;  // width and height are 0 where the calibration does not give them
  Lens lens;
  std::filesystem::path image;  // of this camera, where the calibration names one; as the file gives it
  std::filesystem::path mask;   // likewise
};

// Resamples the images of one camera. Const methods may be called from many threads; they use all threads themselves
// where none is used yet.
class Undistorter {
 public:
  // `target` is the pinhole to make images of: usually source.camera itself, with its K and size, or the same resized.
  // Only its K and size are used. Works out, on all threads, where each pixel comes from: 8 bytes for each sample.
  Undistorter(const DistortedCamera& source, const Camera& target);

  // 255 where a pixel of the target is valid: all source pixels that it is made of lie inside the image, and the lens
  // model is one to one there (geometry/lens.h).
  const ImageU8& valid() const { return valid_; }
  bool all_valid() const { return all_valid_; }
  int samples() const { return samples_ * samples_; }  // a pixel: 1, and more where the target is coarser

  // Bilinear samples, averaged over a pixel; 0 where not valid. The image must have the source's size.
  ImageU8 Undistort(const ImageU8& image) const;

  // 255 where the pixel is valid and all source pixels that enter it are 255.
  ImageU8 UndistortMask(const ImageU8& mask) const;

 private:
  struct Position {
    float x = -1, y = -1;  // px of the source, first pixel's centre at (0, 0); -1 where not valid
  };
  void FindSamples(const DistortedCamera& source, const Camera& target);
  void FindPositions(const DistortedCamera& source, const Camera& target);
  const Position* At(int x, int y) const {
    return positions_.data() + (static_cast<size_t>(y) * valid_.width() + x) * samples();
  }

  int source_width_ = 0, source_height_ = 0;
  int samples_ = 1;  // along each side of a target pixel
  bool all_valid_ = true;
  ImageU8 valid_;
  std::vector<Position> positions_;
};

// Whether images of the source are those of the target already, pixel for pixel.
bool IsSameImage(const DistortedCamera& source, const Camera& target);

}  // namespace likeness
