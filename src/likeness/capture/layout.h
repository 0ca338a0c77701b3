// Where things lie in the Multiface layout (and in our additions to it). The one place that spells these paths.

#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/capture/capture.h"

namespace likeness {

// Whether a camera, segment or frame may have this name: it becomes a word of text files and the name of a file.
// "average" is taken by the average textures.
inline bool IsLayoutName(std::string_view name) {
  return !name.empty() && name[0] != '.' && name != "average" && name.size() < 200 &&
         std::all_of(name.begin(), name.end(),
                     [](unsigned char c) { return c > 32 && c < 127 && c != '/' && c != '\\' && c != '"'; });
}

class CaptureLayout {
 public:
  explicit CaptureLayout(std::filesystem::path root) : root_(std::move(root)) {}

  std::filesystem::path Calibration() const { return root_ / "KRT"; }
  std::filesystem::path FrameList() const { return root_ / "frame_list.txt"; }
  std::filesystem::path SplitFile() const { return root_ / "split.json"; }
  std::filesystem::path Image(const FrameId& f, const std::string& camera) const {
    return root_ / "images" / f.segment / camera / (f.frame + ".png");
  }
  // Ours: 255 where a pixel shows the head.
  std::filesystem::path HeadMask(const FrameId& f, const std::string& camera) const {
    return root_ / "masks" / f.segment / camera / (f.frame + ".png");
  }
  // Ours: 255 where the pixels of a camera are valid, which undistorted images are not up to their borders. Absent
  // where all are.
  std::filesystem::path ValidMask(const std::string& camera) const { return root_ / "valid" / (camera + ".png"); }
  std::filesystem::path MeshBinary(const FrameId& f) const { return Tracked(f, ".bin"); }
  std::filesystem::path MeshObj(const FrameId& f) const { return Tracked(f, ".obj"); }
  std::filesystem::path HeadPose(const FrameId& f) const { return Tracked(f, "_transform.txt"); }

  std::filesystem::path TextureFolder(int size) const { return root_ / ("unwrapped_uv_" + std::to_string(size)); }
  std::filesystem::path Texture(const FrameId& f, const std::string& camera, int size) const {
    return TextureFolder(size) / f.segment / camera / (f.frame + ".png");
  }
  std::filesystem::path AverageTexture(const FrameId& f, int size) const { return Texture(f, "average", size); }
  // Ours: 255 where the texel was seen. Published captures mark unseen texels by the value 0 instead.
  std::filesystem::path TextureMaskFolder(int size) const { return root_ / ("unwrapped_mask_" + std::to_string(size)); }
  std::filesystem::path TextureMask(const FrameId& f, const std::string& camera, int size) const {
    return TextureMaskFolder(size) / f.segment / camera / (f.frame + ".png");
  }
  std::filesystem::path TextureMean() const { return root_ / "tex_mean.png"; }
  std::filesystem::path TextureVariance() const { return root_ / "tex_var.txt"; }
  std::filesystem::path VertexMean() const { return root_ / "vert_mean.bin"; }
  std::filesystem::path VertexVariance() const { return root_ / "vert_var.txt"; }
  // Ours: named conditions of every frame (condition_file.h).
  std::filesystem::path Conditions() const { return root_ / "conditions"; }
  std::filesystem::path Condition(const std::string& name) const { return Conditions() / (name + ".csv"); }
  // Ours, of simulated captures: what was put in.
  std::filesystem::path Truth() const { return root_ / "truth"; }

 private:
  std::filesystem::path Tracked(const FrameId& f, const std::string& ending) const {
    return root_ / "tracked_mesh" / f.segment / (f.frame + ending);
  }

  std::filesystem::path root_;
};

// Sizes of the unwrapped textures that a capture has, smallest first.
std::vector<int> TextureSizes(const std::filesystem::path& capture_root);

}  // namespace likeness
