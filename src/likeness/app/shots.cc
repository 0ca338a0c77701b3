#include "likeness/app/shots.h"

#include <algorithm>

#include "likeness/app/capture_flags.h"
#include "likeness/base/error.h"
#include "likeness/image/resize.h"
#include "likeness/render/portrait.h"
#include "likeness/render/stereo.h"

namespace likeness {

void ShotOptions::Check() const {
  if (!capture.empty() && !beside_truth.empty()) {
    throw UsageError("--beside-truth names the capture; --capture does not go with it");
  }
  if (camera.empty() != (capture.empty() && beside_truth.empty())) {
    throw UsageError("--camera and --capture, or --camera and --beside-truth, belong together");
  }
  if (width < 0 || height < 0 || width > 16384 || height > 16384) {
    throw UsageError("--width and --height are 0 to 16384 pixels");
  }
  if (!(eye_distance_mm >= 0 && eye_distance_mm <= 500)) throw UsageError("--eye-distance is 0 to 500 mm");
}

void AddShotFlags(Command* command, ShotOptions* options) {
  command->Option("view", &options->view, "AZIMUTH,ELEVATION in degrees: towards the subject's left, and up");
  command->Option("camera", &options->camera, "the view of this camera of --capture instead");
  command->Option("capture", &options->capture, "folder of the capture that --camera belongs to");
  command->Option("beside-truth", &options->beside_truth,
                  "the same, with the camera's own picture at the right of each");
  command->Option("width", &options->width, "pixels; 0: 768, or the camera's");
  command->Option("height", &options->height, "pixels; 0: 1024, or the camera's");
  command->Option("focal", &options->focal_px, "focal length in pixels; 0: the head fits, or the camera's");
  command->Choice("stereo", &options->stereo, {"off", "side-by-side"},
                  "a picture for each eye, the left eye's at the left, each decoded for its own view");
  command->Option("eye-distance", &options->eye_distance_mm, "mm between the eyes");
  AddCaptureFlags(command, &options->capture_options);
}

Shots::Shots(const Avatar& avatar, const ShotOptions& options) : avatar_(avatar), options_(options) {
  if (options.camera.empty()) return;
  const auto& folder = options.beside_truth.empty() ? options.capture : options.beside_truth;
  capture_ = OpenCapture(folder, options.capture_options);
  Camera camera = capture_->FindCamera(options.camera);
  if (camera.width == 0) throw Error("camera {} has no image that tells its size", options.camera);
  camera = camera.Resized(options.width > 0 ? options.width : camera.width,
                          options.height > 0 ? options.height : camera.height);
  if (options.focal_px > 0) camera.intrinsics(0, 0) = camera.intrinsics(1, 1) = options.focal_px;
  capture_camera_ = camera;
}

Camera Shots::MiddleCamera(const ClipFrame& frame) const {
  if (capture_ != nullptr) return capture_camera_;
  PortraitOptions portrait;
  ParseView(options_.view, &portrait.azimuth_deg, &portrait.elevation_deg);
  portrait.width = options_.width > 0 ? options_.width : 768;
  portrait.height = options_.height > 0 ? options_.height : 1024;
  portrait.focal_px = options_.focal_px;
  const Vertices& mean = avatar_.identities[frame.conditions.identity].vertex_mean;
  // A camera that goes around keeps its focal length.
  if (frame.azimuth_deg != 0 && portrait.focal_px == 0) {
    portrait.focal_px = PortraitCamera(mean, avatar_.topology, portrait).intrinsics(0, 0);
  }
  portrait.azimuth_deg += frame.azimuth_deg;
  return PortraitCamera(mean, avatar_.topology, portrait);
}

// A frame that the avatar names stands as it did then; anything else as in the first frame.
FrameId Shots::CaptureFrame(const ClipFrame& frame) const {
  return frame.segment.empty() ? capture_->frames().front() : FrameId{frame.segment, frame.frame};
}

Shot Shots::Of(const ClipFrame& frame) const {
  Shot shot;
  const Camera middle = MiddleCamera(frame);
  shot.world_from_head = frame.world_from_head;
  if (capture_ != nullptr) {
    shot.world_from_head = capture_->ReadTracked(CaptureFrame(frame)).world_from_head * frame.world_from_head;
  }
  if (options_.stereo == "off") {
    shot.cameras = {middle};
  } else {
    const double distance_mm = (middle.cam_from_world * shot.world_from_head.translation).z();
    const double offset_mm = options_.eye_distance_mm / 2;
    shot.cameras = {EyeCamera(middle, -offset_mm, distance_mm), EyeCamera(middle, offset_mm, distance_mm)};
  }
  return shot;
}

ImageU8 Shots::TruthOf(const ClipFrame& frame) const {
  const FrameId id = CaptureFrame(frame);
  const ImageU8 seen = capture_->ReadCameraImage(id, capture_->FindCamera(options_.camera));
  if (seen.width() == capture_camera_.width && seen.height() == capture_camera_.height) return seen;
  return capture_camera_.width < seen.width() ? ResizeArea(seen, capture_camera_.width, capture_camera_.height)
                                              : ResizeBilinear(seen, capture_camera_.width, capture_camera_.height);
}

}  // namespace likeness
