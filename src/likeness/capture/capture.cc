#include "likeness/capture/capture.h"

#include <algorithm>

#include "likeness/base/error.h"
#include "likeness/base/text.h"
#include "likeness/capture/ava256/ava256.h"
#include "likeness/capture/multiface.h"

namespace likeness {

bool Split::IsHeldOutCamera(const std::string& camera) const {
  return std::find(held_out_cameras.begin(), held_out_cameras.end(), camera) != held_out_cameras.end();
}

bool Split::IsHeldOutSegment(const std::string& segment) const {
  return std::any_of(held_out_segments.begin(), held_out_segments.end(),
                     [&](const std::string& prefix) { return segment.starts_with(prefix); });
}

std::optional<ImageU8> Capture::ReadValidMask(const Camera&) const { return std::nullopt; }

const Camera& Capture::FindCamera(const std::string& name) const {
  std::vector<std::string> names;
  for (const Camera& camera : cameras()) {
    if (camera.name == name) return camera;
    names.push_back(camera.name);
  }
  const std::string nearest = NearestWord(name, names);
  throw Error("{}: there is no camera '{}'{}", root().string(), name,
              nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest));
}

std::vector<Camera> Capture::TrainingCameras() const {
  std::vector<Camera> chosen;
  for (const std::string& name : split().training_cameras) chosen.push_back(FindCamera(name));
  return chosen;
}

std::vector<Camera> Capture::HeldOutCameras() const {
  std::vector<Camera> chosen;
  for (const std::string& name : split().held_out_cameras) chosen.push_back(FindCamera(name));
  return chosen;
}

std::vector<FrameId> Capture::TrainingFrames() const {
  std::vector<FrameId> chosen;
  for (const FrameId& frame : frames()) {
    if (!split().IsHeldOutSegment(frame.segment)) chosen.push_back(frame);
  }
  return chosen;
}

std::vector<FrameId> Capture::HeldOutFrames() const {
  std::vector<FrameId> chosen;
  for (const FrameId& frame : frames()) {
    if (split().IsHeldOutSegment(frame.segment)) chosen.push_back(frame);
  }
  return chosen;
}

std::unique_ptr<Capture> OpenCapture(const std::filesystem::path& root, const CaptureOptions& options) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(root, ignored)) throw FileError(root, "no such folder");
  if (IsMultiface(root)) return OpenMultiface(root, options);
  if (IsAva256(root)) return OpenAva256(root, options);
  throw FileError(
      root,
      "is no capture: expected the Multiface layout, with KRT, frame_list.txt and tracked_mesh/, or that of "
      "Ava-256 and Goliath, with camera_calibration.json, frame_list.csv or frame_splits_list.csv, and image/");
}

}  // namespace likeness
