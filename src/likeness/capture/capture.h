// A multi-camera capture of a face: what every later stage works from, whatever layout it has on disk.

#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "likeness/geometry/camera.h"
#include "likeness/geometry/mesh.h"
#include "likeness/image/image.h"

namespace likeness {

// One instant of a segment. Names are the layout's own, so that files are found again.
struct FrameId {
  std::string segment;  // "EXP_ROM"
  std::string frame;    // "000123"
  auto operator<=>(const FrameId&) const = default;
};

// Which cameras and segments are for training and which are held out.
struct Split {
  std::vector<std::string> training_cameras;  // in the capture's order
  std::vector<std::string> held_out_cameras;
  std::vector<std::string> held_out_segments;  // prefixes

  bool IsHeldOutCamera(const std::string& camera) const;
  bool IsHeldOutSegment(const std::string& segment) const;
};

// A frame that the capture lists but that cannot be used, and why: "tracked_mesh/E1/000007.bin is absent".
struct SkippedFrame {
  FrameId frame;
  std::string reason;
};

// Tracked geometry of one frame.
struct TrackedFrame {
  Vertices vertices_in_head;       // mm; x to the subject's left, y up, z out of the nose
  RigidTransform world_from_head;  // mm
};

// What a capture's textures and meshes are standardised with, as its publisher gives it.
struct PublishedStatistics {
  ImageU8 texture_mean;            // RGB, square, row 0 is v = 1
  double texture_variance = 0;     // 0 ... 255 squared
  std::vector<float> vertex_mean;  // 3 values a vertex, mm, head space
  double vertex_variance = 0;      // mm squared
};

// Cameras, frames and topology are in memory; images, textures and meshes are read when asked for. Const methods may be
// called from many threads at once.
class Capture {
 public:
  virtual ~Capture() = default;

  virtual const std::filesystem::path& root() const = 0;
  virtual std::string layout_name() const = 0;             // "Multiface"
  virtual const std::vector<Camera>& cameras() const = 0;  // width and height are 0 where a camera has no image at all
  virtual const std::vector<FrameId>& frames() const = 0;  // listed and with a mesh, in the list's order
  virtual const std::vector<SkippedFrame>& skipped_frames() const = 0;  // the rest of the list
  virtual const MeshTopology& topology() const = 0;
  virtual const Split& split() const = 0;  // all cameras and segments train when none is given

  // Throws Error naming the file when it is absent or wrong.
  virtual TrackedFrame ReadTracked(const FrameId& frame) const = 0;
  virtual ImageU8 ReadCameraImage(const FrameId& frame, const Camera& camera) const = 0;  // RGB

  virtual bool HasCameraImage(const FrameId& frame, const Camera& camera) const = 0;
  virtual bool HasHeadMask(const FrameId& frame, const Camera& camera) const = 0;
  // None where the capture has no such file.
  virtual std::optional<ImageU8> ReadHeadMask(const FrameId& frame, const Camera& camera) const = 0;  // 255 = head

  // 255 = the camera shows something there, in every frame (undistorted images have empty corners). None where all
  // pixels do.
  virtual std::optional<ImageU8> ReadValidMask(const Camera& camera) const;

  // A file of its own that holds just what ReadCameraImage gives; none where there is no image, or it is in an archive.
  virtual std::optional<std::filesystem::path> ImageFile(const FrameId&, const Camera&) const { return std::nullopt; }
  // RGB, square, row 0 is v = 1: the mean over cameras, of the largest size that there is of this frame.
  virtual std::optional<ImageU8> ReadAverageTexture(const FrameId&) const { return std::nullopt; }
  // None where the layout keeps them beside the textures (texture/texture_set.h) or there are none.
  virtual std::optional<PublishedStatistics> ReadPublishedStatistics() const { return std::nullopt; }

  const Camera& FindCamera(const std::string& name) const;  // throws Error naming the nearest known one
  std::vector<Camera> TrainingCameras() const;
  std::vector<Camera> HeldOutCameras() const;
  std::vector<FrameId> TrainingFrames() const;
  std::vector<FrameId> HeldOutFrames() const;
};

// What a capture's own files may leave open. An empty path means the default.
struct CaptureOptions {
  // JSON that names training and held-out cameras, {"full": {"train": [...], "test": [...]}}, and perhaps held-out
  // segments, {"segment": [prefix, ...]}. Default: ROOT/split.json where it exists; otherwise everything trains.
  std::filesystem::path split_file;
  // JSON with the held-out segments alone; replaces those of the split file.
  std::filesystem::path test_segments_file;
  // An .obj with faces and texture coordinates. Default: that of the first frame that has one (Multiface), or of the
  // capture (ava256/ava256.h).
  std::filesystem::path topology_file;
  // What is done about lens distortion in published calibrations: "refuse" (an Error), "ignore" (K is used alone), or
  // "undistort" (images and masks are resampled when read; ReadValidMask tells what they cover).
  std::string distortion = "refuse";
};

// Opens a folder in any layout that is known: Multiface, Ava-256, Goliath. Throws Error that says what was looked for.
std::unique_ptr<Capture> OpenCapture(const std::filesystem::path& root, const CaptureOptions& options = {});

}  // namespace likeness
