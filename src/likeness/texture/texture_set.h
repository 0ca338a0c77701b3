// The unwrapped textures of a capture, as training and evaluation read them.

#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/capture/capture.h"
#include "likeness/capture/layout.h"
#include "likeness/image/image.h"

namespace likeness {

// What training data are standardised with: (T - mean) / sqrt(variance), (M - vertex_mean) / sqrt(vertex_variance).
struct TextureStatistics {
  ImageF mean;                     // size x size x 3, 0 ... 255; row 0 is v = 1
  double variance = 0;             // of all seen texels and channels about their means, 0 ... 255 squared
  std::vector<float> vertex_mean;  // 3 values a vertex, mm, head space
  double vertex_variance = 0;      // of all coordinates about their means, mm squared
};

// The variance files of the Multiface layout: one positive number. Throws Error naming the file for anything else.
double ParseVariance(const std::filesystem::path& path_for_errors, std::string_view text);

// Opens what `likeness unwrap` (or another program, in the Multiface layout) has made of a capture at one texture size.
// Const methods may be called from many threads. The capture must outlive the set.
class TextureSet {
 public:
  // Throws Error, naming the sizes that exist, where there are no textures of this size.
  TextureSet(const Capture& capture, int size);

  int size() const { return size_; }
  const Capture& capture() const { return capture_; }

  // Whether this view was unwrapped: cameras can lack an image of a frame.
  bool HasTexture(const FrameId& frame, const std::string& camera) const;

  // RGB, size x size, row 0 is v = 1; 0 where the camera does not see the texel.
  ImageU8 ReadTexture(const FrameId& frame, const std::string& camera) const;
  // 1 channel: 255 where the camera sees the texel, else 0. Published captures have no masks; there a texel is unseen
  // when all its channels are 0 (published code decides this for each channel on its own, which also drops the dark
  // channels of seen texels).
  ImageU8 ReadMask(const FrameId& frame, const std::string& camera) const;
  ImageU8 ReadMask(const FrameId& frame, const std::string& camera, const ImageU8& texture) const;  // saves a reading

  // Mean over the training cameras that see a texel (Lombardi et al. 2018, equation 1); 0 where none does.
  ImageU8 ReadAverage(const FrameId& frame) const;

  // Those of this size in unwrapped_uv_<size>, otherwise those in the capture's root. Throws Error when they are absent
  // or of another size.
  TextureStatistics ReadStatistics() const;

 private:
  ImageU8 ReadSquare(const std::filesystem::path& path, int channels) const;

  const Capture& capture_;
  const CaptureLayout layout_;
  const int size_;
};

// Reads a variance: one positive number in a text file. Throws Error.
double ReadVariance(const std::filesystem::path& path);

}  // namespace likeness
