#include "likeness/capture/carry_textures.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

class Planner {
 public:
  Planner(const Capture& source, const CaptureLayout& out, const std::vector<Camera>& cameras,
          const std::vector<FrameId>& frames)
      : from_(source.root()),
        to_(out),
        cameras_(cameras),
        frames_(frames),
        all_cameras_(cameras.size() == source.cameras().size()),
        all_frames_(frames.size() == source.frames().size()) {}

  TexturePlan Plan(const std::vector<int>& sizes) && {
    for (const int size : sizes) {
      for (const FrameId& frame : frames_) {
        for (const Camera& camera : cameras_) {
          Add(from_.Texture(frame, camera.name, size), to_.Texture(frame, camera.name, size));
          Add(from_.TextureMask(frame, camera.name, size), to_.TextureMask(frame, camera.name, size));
        }
        if (all_cameras_) Add(from_.AverageTexture(frame, size), to_.AverageTexture(frame, size));
      }
      // With this record, `likeness unwrap` knows what the textures were made with, and makes only what is missing.
      for (const char* name : {"state.json", "unwrap.toml"}) {
        Add(from_.TextureFolder(size) / name, to_.TextureFolder(size) / name);
      }
      AddStatistics(CaptureLayout(from_.TextureFolder(size)), CaptureLayout(to_.TextureFolder(size)));
    }
    AddStatistics(from_, to_);
    if (!all_cameras_) plan_.dropped.emplace_back("average textures and statistics: cameras are left out");
    if (all_cameras_ && !all_frames_) plan_.dropped.emplace_back("statistics of textures: frames are left out");
    return std::move(plan_);
  }

 private:
  void Add(const fs::path& from, const fs::path& to) {
    std::error_code ignored;
    if (fs::exists(from, ignored)) plan_.files.emplace_back(from, to);
  }

  void AddStatistics(const CaptureLayout& from, const CaptureLayout& to) {
    if (!all_cameras_ || !all_frames_) return;
    Add(from.TextureVariance(), to.TextureVariance());
    Add(from.VertexMean(), to.VertexMean());
    Add(from.VertexVariance(), to.VertexVariance());
    Add(from.TextureMean(), to.TextureMean());
  }

  const CaptureLayout from_, to_;
  const std::vector<Camera>& cameras_;
  const std::vector<FrameId>& frames_;
  const bool all_cameras_, all_frames_;
  TexturePlan plan_;
};

}  // namespace

TexturePlan PlanTextures(const Capture& source, const CaptureLayout& out, const std::vector<Camera>& cameras,
                         const std::vector<FrameId>& frames, bool resized) {
  const std::vector<int> sizes = TextureSizes(source.root());
  std::error_code ignored;
  if (sizes.empty() && !fs::exists(CaptureLayout(source.root()).TextureMean(), ignored)) return {};
  if (resized) return {{}, {"textures and statistics: images have another size; likeness unwrap makes new ones"}};
  return Planner(source, out, cameras, frames).Plan(sizes);
}

}  // namespace likeness
