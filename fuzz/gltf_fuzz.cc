// glTF scenes: a GLB as it is, or the text of one, a zero byte, and its binary chunk, which are put into a container
// whose lengths are right.

#include "fuzz.h"
#include "likeness/simulate/glb/gltf_scene.h"

namespace likeness {
namespace {

void AppendChunk(std::string* file, std::string chunk, uint32_t kind, char padding) {
  chunk.resize((chunk.size() + 3) / 4 * 4, padding);
  for (const uint32_t word : {static_cast<uint32_t>(chunk.size()), kind}) {
    file->append(reinterpret_cast<const char*>(&word), sizeof(word));
  }
  *file += chunk;
}

std::string Contained(std::string_view bytes) {
  const size_t end = std::min(bytes.find('\0'), bytes.size());
  std::string file("glTF\2\0\0\0\0\0\0\0", 12);
  AppendChunk(&file, std::string(bytes.substr(0, end)), 0x4E4F534A, ' ');
  AppendChunk(&file, std::string(bytes.substr(std::min(end + 1, bytes.size()))), 0x004E4942, '\0');
  const auto length = static_cast<uint32_t>(file.size());
  return file.replace(8, sizeof(length), reinterpret_cast<const char*>(&length), sizeof(length));
}

}  // namespace

void fuzz::Run(std::string_view bytes) {
  const std::string file = bytes.starts_with("glTF") ? std::string(bytes) : Contained(bytes);
  const auto scene = Parsed([&] { return ParseGltf(kPath, file); });
  if (!scene) return;
  const auto is_index = [](int index, size_t count) { return index >= -1 && index < static_cast<int>(count); };
  for (const GltfMaterial& material : scene->materials) {
    for (const int image : {material.base_image, material.normal_image, material.rough_metal_image}) {
      LIKENESS_CHECK(is_index(image, scene->images.size()));
    }
  }
  for (const GltfPart& part : scene->parts) {
    const auto count = static_cast<int>(part.positions.rows());
    LIKENESS_CHECK(is_index(part.material, scene->materials.size()));
    LIKENESS_CHECK(part.positions.allFinite() && static_cast<int>(part.uvs.size()) == count);
    for (const Eigen::Vector3i& t : part.triangles) LIKENESS_CHECK(t.minCoeff() >= 0 && t.maxCoeff() < count);
    for (const GltfMorph& morph : part.morphs) {
      LIKENESS_CHECK(morph.vertices.size() == morph.deltas.size());
      for (const int vertex : morph.vertices) LIKENESS_CHECK(vertex >= 0 && vertex < count);
      for (const Eigen::Vector3f& delta : morph.deltas) LIKENESS_CHECK(delta.allFinite());
    }
  }
}

}  // namespace likeness
