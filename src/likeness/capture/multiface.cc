#include "likeness/capture/multiface.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/capture/calibration.h"
#include "likeness/capture/layout.h"
#include "likeness/capture/split_file.h"
#include "likeness/geometry/obj.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

class MultifaceCapture : public Capture {
 public:
  MultifaceCapture(const fs::path& root, const CaptureOptions& options) : root_(root), layout_(root) {
    cameras_ = ParseCalibration(layout_.Calibration(), ReadFile(layout_.Calibration()));
    FindFrames();
    FindImageSizes();
    FindTopology(options.topology_file);
    split_ = FindSplit(layout_.SplitFile(), options, cameras_);
  }

  const fs::path& root() const override { return root_; }
  std::string layout_name() const override { return "Multiface"; }
  const std::vector<Camera>& cameras() const override { return cameras_; }
  const std::vector<FrameId>& frames() const override { return frames_; }
  const std::vector<SkippedFrame>& skipped_frames() const override { return skipped_; }
  const MeshTopology& topology() const override { return topology_; }
  const Split& split() const override { return split_; }

  TrackedFrame ReadTracked(const FrameId& frame) const override {
    const auto values = ReadFloats(layout_.MeshBinary(frame), 3 * static_cast<size_t>(topology_.vertex_count));
    TrackedFrame tracked;
    tracked.vertices_in_head = Eigen::Map<const Vertices>(values.data(), topology_.vertex_count, 3);
    tracked.world_from_head = ParseTransform(layout_.HeadPose(frame), ReadFile(layout_.HeadPose(frame), kMostText));
    return tracked;
  }

  ImageU8 ReadCameraImage(const FrameId& frame, const Camera& camera) const override {
    return ReadChecked(layout_.Image(frame, camera.name), camera, 3);
  }

  bool HasCameraImage(const FrameId& frame, const Camera& camera) const override {
    std::error_code ignored;
    return fs::exists(layout_.Image(frame, camera.name), ignored);
  }

  std::optional<fs::path> ImageFile(const FrameId& frame, const Camera& camera) const override {
    if (!HasCameraImage(frame, camera)) return std::nullopt;
    return layout_.Image(frame, camera.name);
  }

  std::optional<ImageU8> ReadAverageTexture(const FrameId& frame) const override {
    const std::vector<int> sizes = TextureSizes(root_);
    for (auto size = sizes.rbegin(); size != sizes.rend(); ++size) {
      const fs::path path = layout_.AverageTexture(frame, *size);
      std::error_code ignored;
      if (fs::exists(path, ignored)) return ReadImage(path);
    }
    return std::nullopt;
  }

  bool HasHeadMask(const FrameId& frame, const Camera& camera) const override {
    std::error_code ignored;
    return fs::exists(layout_.HeadMask(frame, camera.name), ignored);
  }

  std::optional<ImageU8> ReadHeadMask(const FrameId& frame, const Camera& camera) const override {
    if (!HasHeadMask(frame, camera)) return std::nullopt;
    return ReadChecked(layout_.HeadMask(frame, camera.name), camera, 1);
  }

  std::optional<ImageU8> ReadValidMask(const Camera& camera) const override {
    const fs::path path = layout_.ValidMask(camera.name);
    std::error_code ignored;
    if (!fs::exists(path, ignored)) return std::nullopt;
    return ReadChecked(path, camera, 1);
  }

 private:
  static constexpr uint64_t kMostText = 1 << 16;  // bytes of a transform

  ImageU8 ReadChecked(const fs::path& path, const Camera& camera, int channels) const {
    ImageU8 image = ReadImage(path, channels);
    if (image.width() != camera.width || image.height() != camera.height) {
      throw FileError(path, fmt::format("is {} x {} pixels, but camera {} has {} x {}", image.width(), image.height(),
                                        camera.name, camera.width, camera.height));
    }
    return image;
  }

  // What tracked_mesh/SEGMENT holds; read once a segment, as a capture has thousands of frames.
  const std::set<std::string>& MeshFiles(const std::string& segment) {
    const auto [it, added] = mesh_files_.try_emplace(segment);
    if (added) {
      for (std::string& name : ListFolder(root_ / "tracked_mesh" / segment)) it->second.insert(std::move(name));
    }
    return it->second;
  }

  void FindFrames() {
    std::set<FrameId> seen;
    for (const FrameId& frame : ParseFrameList(layout_.FrameList(), ReadFile(layout_.FrameList()))) {
      const std::set<std::string>& files = MeshFiles(frame.segment);
      const auto absent = [&](const fs::path& path) { return !files.contains(path.filename().string()); };
      std::string reason;
      if (!seen.insert(frame).second) reason = "is listed twice";
      for (const fs::path& path : {layout_.MeshBinary(frame), layout_.HeadPose(frame)}) {
        if (reason.empty() && absent(path)) reason = path.lexically_relative(root_).string() + " is absent";
      }
      if (reason.empty()) {
        frames_.push_back(frame);
      } else {
        skipped_.push_back({frame, reason});
      }
    }
    if (frames_.empty()) {
      throw FileError(layout_.FrameList(), fmt::format("none of its {} frames has a tracked mesh: {}", skipped_.size(),
                                                       skipped_.front().reason));
    }
  }

  void FindImageSizes() {
    std::vector<std::string> segments;
    for (const FrameId& frame : frames_) {
      if (segments.empty() || segments.back() != frame.segment) segments.push_back(frame.segment);
    }
    for (Camera& camera : cameras_) {
      for (size_t i = 0; i < segments.size() && camera.width == 0; ++i) {
        const fs::path folder = root_ / "images" / segments[i] / camera.name;
        for (const std::string& name : ListFolder(folder)) {
          if (name.starts_with('.') || !name.ends_with(".png")) continue;
          const ImageInfo info = ReadImageInfo(folder / name);
          camera.width = info.width;
          camera.height = info.height;
          break;
        }
      }
    }
  }

  void FindTopology(fs::path path) {
    for (size_t i = 0; i < frames_.size() && path.empty(); ++i) {
      const fs::path candidate = layout_.MeshObj(frames_[i]);
      if (MeshFiles(frames_[i].segment).contains(candidate.filename().string())) path = candidate;
    }
    if (path.empty()) {
      throw FileError(root_ / "tracked_mesh",
                      "no frame has an .obj file, which gives faces and texture coordinates; name one with --topology");
    }
    topology_ = TopologyFromObj(ReadObj(path), path.string());
    topology_.Check(path.string());
    if (topology_.triangles.empty()) throw FileError(path, "has no faces");
  }

  const fs::path root_;
  const CaptureLayout layout_;
  std::vector<Camera> cameras_;
  std::vector<FrameId> frames_;
  std::vector<SkippedFrame> skipped_;
  MeshTopology topology_;
  Split split_;
  std::map<std::string, std::set<std::string>> mesh_files_;
};

}  // namespace

bool IsMultiface(const fs::path& root) {
  const CaptureLayout layout(root);
  std::error_code ignored;
  return fs::exists(layout.Calibration(), ignored) && fs::exists(layout.FrameList(), ignored);
}

std::unique_ptr<Capture> OpenMultiface(const fs::path& root, const CaptureOptions& options) {
  return std::make_unique<MultifaceCapture>(root, options);
}

}  // namespace likeness
