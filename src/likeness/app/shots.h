// Where rendered pictures are taken from: around the head, or as a capture's camera sees it; by one eye or two.

#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "likeness/app/clip.h"
#include "likeness/app/command.h"
#include "likeness/avatar/avatar.h"
#include "likeness/capture/capture.h"
#include "likeness/geometry/camera.h"

namespace likeness {

struct ShotOptions {
  std::string view = "0,0";
  std::string camera;
  std::filesystem::path capture;
  std::filesystem::path beside_truth;
  CaptureOptions capture_options;
  int width = 0, height = 0;
  double focal_px = 0;
  std::string stereo = "off";  // or "side-by-side"
  double eye_distance_mm = 63;

  // Throws UsageError.
  void Check() const;
};

// --view, --camera, --capture, --beside-truth, --width, --height, --focal, --stereo, --eye-distance, and the capture's
// own
void AddShotFlags(Command* command, ShotOptions* options);

struct Shot {
  std::vector<Camera> cameras;  // one; in stereo the left eye's and the right eye's
  RigidTransform world_from_head;
};

class Shots {
 public:
  // Throws Error when the capture or its camera are not there.
  Shots(const Avatar& avatar, const ShotOptions& options);

  Shot Of(const ClipFrame& frame) const;
  // What the camera saw, at the shot's size. Throws Error where the capture lacks the frame.
  ImageU8 TruthOf(const ClipFrame& frame) const;

 private:
  Camera MiddleCamera(const ClipFrame& frame) const;
  FrameId CaptureFrame(const ClipFrame& frame) const;

  const Avatar& avatar_;
  const ShotOptions options_;
  std::unique_ptr<Capture> capture_;  // null: around the head
  Camera capture_camera_;
};

}  // namespace likeness
