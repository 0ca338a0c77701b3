// What the checks of one validation share: the capture as its files say it is, with what was found wrong already
// corrected, and the findings so far.

#pragma once

#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "likeness/base/file.h"
#include "likeness/capture/capture.h"
#include "likeness/capture/layout.h"
#include "likeness/validate/finding.h"
#include "likeness/validate/validate.h"
#include "likeness/validate/view_fit.h"

namespace likeness {

// A listed frame and what its files hold.
struct ExaminedFrame {
  FrameId id;
  bool has_mesh = false, has_pose = false;  // readable, as far as was looked
  RigidTransform world_from_head;           // perhaps not rigid
  Vertices vertices;                        // of sampled frames, else empty
  std::vector<View> views;                  // of sampled frames: one a camera, empty where absent
  bool sampled() const { return vertices.rows() > 0; }
};

class Examination {
 public:
  Examination(const std::filesystem::path& root, const ValidateOptions& options);

  const std::filesystem::path root;
  const CaptureLayout layout;
  const ValidateOptions options;
  bool multiface = false;            // files are where CaptureLayout says; otherwise `capture` alone reads them
  std::unique_ptr<Capture> capture;  // null where OpenCapture refused
  std::string refusal;               // why it did

  std::vector<Camera> cameras;                                   // width and height 0 where a camera has no images
  std::vector<ExaminedFrame> frames;                             // each listed one once
  MeshTopology topology;                                         // no triangles when it could not be read
  Eigen::Matrix3d mesh_from_file = Eigen::Matrix3d::Identity();  // correction of all meshes: scale, axes
  std::vector<SurfacePoint> points;
  std::set<std::pair<size_t, size_t>> doubtful;  // frame and camera of pictures that belong elsewhere: not looked at
  bool textures_fit = true;                      // stored textures show what the cameras show
  bool placed = false;                           // the mesh lies on the head in the pictures: finer checks make sense
  ValidationReport report;

  // Adds a finding. `where` is a path for files: it is shown relative to the root.
  Finding& Found(const char* code, Severity severity, const std::string& where, std::string what, std::string advice);
  std::string Relative(const std::filesystem::path& path) const;

  // The frame's mesh as its file has it; throws Error.
  Vertices ReadVertices(const FrameId& id) const;
  // The camera's picture made small; an empty view when there is none or it cannot be read.
  View ReadView(const FrameId& id, const Camera& camera) const;

  bool CanFit() const { return !cameras.empty() && !topology.triangles.empty() && !points.empty(); }
  std::vector<int> SampledFrames() const;  // indices

  // The camera at the size of its small views.
  Camera SmallCamera(const Camera& camera) const;
  Placement Place(const ExaminedFrame& frame, size_t camera) const;
};

// The longer side of views, px.
inline constexpr int kViewSide = 256;

// "a, b, c and 5 more"
std::string SomeOf(const std::vector<std::string>& names);

}  // namespace likeness
