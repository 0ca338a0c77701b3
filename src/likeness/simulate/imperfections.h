// What real captures suffer from and simulated ones do not, unless asked: errors of tracking and calibration, and what
// sensors and lenses do to images. Everything is off by default, drawn from a seed, and the same for any number of
// threads, for any order of frames, and whichever other imperfections are on.

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "likeness/capture/capture.h"
#include "likeness/geometry/camera.h"
#include "likeness/geometry/mesh.h"
#include "likeness/image/image.h"

namespace likeness {

struct ImperfectionOptions {
  // Of tracked meshes.
  double tracking_noise_mm = 0;  // root mean square of vertices' distance from where they would be
  int tracking_smoothing = 0;    // Taubin iterations, before the noise
  // Of calibrations.
  double calibration_error_px = 0;  // root mean square of the neutral mesh's reprojection error, in each camera
  // Of images; they leave the masks alone.
  double lens_blur_px = 0;      // standard deviation of a Gaussian, on linear light
  double exposure_flicker = 0;  // standard deviation of a frame's exposure, of all cameras; 0.05 is five per cent
  double sensor_noise = 0;      // standard deviation at mid grey (128), in levels of 255; mostly shot noise
  double colour_gain = 0;       // standard deviation of cameras' gains, by channel, on encoded values
  double colour_bias = 0;       // standard deviation of cameras' biases, by channel, in levels of 255

  bool OfMeshes() const { return tracking_noise_mm > 0 || tracking_smoothing > 0; }
  bool OfImages() const {
    return lens_blur_px > 0 || exposure_flicker > 0 || sensor_noise > 0 || colour_gain > 0 || colour_bias > 0;
  }
  bool Any() const { return OfMeshes() || calibration_error_px > 0 || OfImages(); }

  void Check() const;  // throws Error
};

class Imperfections {
 public:
  //   neutral  of the tracked mesh, in head space: where noise is smooth and calibrations are judged
  Imperfections(const ImperfectionOptions& options, uint64_t seed, const MeshTopology& topology,
                const Vertices& neutral);

  const ImperfectionOptions& options() const { return options_; }

  // A calibration that misses by calibration_error_px: all of pose, focal length and principal point are a little off.
  Camera Calibrated(const Camera& truth) const;

  // What a tracker would give for a mesh. The noise is a random field: smooth over the surface (a tenth of its variance
  // is not) and in time.
  Vertices Tracked(const Vertices& truth, double time_s) const;

  // Changes an image as its camera would: blur, exposure, noise, then the camera's gain and bias.
  void Photograph(const FrameId& frame, const std::string& camera, ImageU8* rgb) const;

  double Exposure(const FrameId& frame) const;                                                // 1 is right
  void Colours(const std::string& camera, Eigen::Array3d* gain, Eigen::Array3d* bias) const;  // bias in levels

 private:
  Vertices Smoothed(Vertices mesh) const;

  ImperfectionOptions options_;
  uint64_t seed_;
  Vertices neutral_;
  std::vector<std::vector<int>> neighbours_;  // of each vertex, for smoothing
};

}  // namespace likeness
