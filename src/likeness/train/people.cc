#include "likeness/train/people.h"

#include <algorithm>

#include "likeness/base/error.h"

namespace likeness {
namespace {

int LargestSize(const std::filesystem::path& capture) {
  const std::vector<int> sizes = TextureSizes(capture);
  if (sizes.empty()) {
    throw Error("{}: has no unwrapped textures; make them: likeness unwrap {}", capture.string(), capture.string());
  }
  return sizes.back();
}

}  // namespace

std::string TopologyDifference(const MeshTopology& first, const MeshTopology& other) {
  if (other.vertex_count != first.vertex_count) {
    return fmt::format("{} vertices, not {}", other.vertex_count, first.vertex_count);
  }
  if (other.triangles != first.triangles) {
    return fmt::format("{} triangles, not the same {}", other.triangles.size(), first.triangles.size());
  }
  if (other.uvs != first.uvs || other.triangle_uvs != first.triangle_uvs) return "other texture coordinates";
  return "";
}

People::People(const TrainOptions& options) {
  std::vector<std::filesystem::path> folders = {options.capture};
  folders.insert(folders.end(), options.also.begin(), options.also.end());
  const int size = options.size > 0 ? options.size : LargestSize(options.capture);
  for (const std::filesystem::path& folder : folders) {
    const std::string name = PersonName(folder);
    if (std::find(names_.begin(), names_.end(), name) != names_.end()) {
      throw Error("{}: there is another capture called '{}'; people are told apart by their captures' folders",
                  folder.string(), name);
    }
    names_.push_back(name);
    captures_.push_back(OpenCapture(folder, options.capture_options));
    textures_.push_back(std::make_unique<TextureSet>(*captures_.back(), size));
    if (const std::string difference = TopologyDifference(topology(), captures_.back()->topology());
        !difference.empty()) {
      throw Error("{}: its mesh has {}; people in one network share the topology of {}", folder.string(), difference,
                  options.capture.string());
    }
  }
}

std::vector<const TextureSet*> People::textures() const {
  std::vector<const TextureSet*> all;
  for (const auto& textures : textures_) all.push_back(textures.get());
  return all;
}

}  // namespace likeness
