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

// Tracked geometry of one frame.
struct TrackedFrame {
  Vertices vertices_in_head;       // mm; x to the subject's left, y up, z out of the nose
  RigidTransform world_from_head;  // mm
};

// Cameras, frames and topology are in memory; images, textures and meshes are read when asked for. Const methods may be
// called from many threads at once.
class Capture {
 public:
  virtual ~Capture() = default;

  virtual const std::filesystem::path& root() const = 0;
  virtual const std::vector<Camera>& cameras() const = 0;  // widths and heights are known
  virtual const std::vector<FrameId>& frames() const = 0;  // listed and with a mesh, in the list's order
  virtual const MeshTopology& topology() const = 0;
  virtual const Split& split() const = 0;  // all cameras and segments train when none is given

  // Throws Error naming the file when it is absent or wrong.
  virtual TrackedFrame ReadTracked(const FrameId& frame) const = 0;
  virtual ImageU8 ReadCameraImage(const FrameId& frame, const Camera& camera) const = 0;  // RGB

  // None where the capture has no such file.
  virtual bool HasCameraImage(const FrameId& frame, const Camera& camera) const = 0;
  virtual std::optional<ImageU8> ReadHeadMask(const FrameId& frame, const Camera& camera) const = 0;  // 255 = head

  const Camera& FindCamera(const std::string& name) const;  // throws Error naming the nearest known one
  std::vector<Camera> TrainingCameras() const;
  std::vector<Camera> HeldOutCameras() const;
  std::vector<FrameId> TrainingFrames() const;
  std::vector<FrameId> HeldOutFrames() const;
};

// Opens a folder in any layout that is known (now: Multiface). Throws Error that says what was looked for.
//   split_file      names training and held-out cameras; default: ROOT/split.json where it exists
std::unique_ptr<Capture> OpenCapture(const std::filesystem::path& root,
                                     const std::optional<std::filesystem::path>& split_file = std::nullopt);

}  // namespace likeness
