// What a glTF shows at rest: triangles with morph targets in one space, and materials. Nodes are placed and skins
// applied.

#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/geometry/mesh.h"
#include "likeness/simulate/glb/read_beside.h"

namespace likeness {

// Displacements of the vertices that a morph target moves.
struct GltfMorph {
  std::string name;           // from mesh.extras.targetNames; "target 3" where there is none
  std::vector<int> vertices;  // ascending
  std::vector<Eigen::Vector3f> deltas;
};

// One primitive of one node. Lengths are in units of the scene (glTF: metres).
struct GltfPart {
  std::string node, mesh;  // names
  int material = -1;       // -1: none
  Vertices positions;
  std::vector<Eigen::Vector2f> uvs;  // one a vertex, v upwards; zero where the file has none
  std::vector<Eigen::Vector3i> triangles;
  std::vector<GltfMorph> morphs;
};

enum class GltfAlpha { kOpaque, kMask, kBlend };

struct GltfMaterial {
  std::string name;
  std::array<float, 4> base_colour = {1, 1, 1, 1};  // linear
  int base_image = -1, normal_image = -1, rough_metal_image = -1;
  float normal_scale = 1, roughness = 1, metallic = 1;
  GltfAlpha alpha = GltfAlpha::kOpaque;
  float alpha_cutoff = 0.5f;
  bool double_sided = false;
};

struct GltfScene {
  std::vector<GltfPart> parts;
  std::vector<GltfMaterial> materials;
  std::vector<std::string> images;  // encoded: PNG, JPEG or WebP
};

// Throws Error for all that is wrong: indices, ranges, cycles of nodes, numbers that are not finite.
GltfScene ParseGltf(const std::filesystem::path& path_for_errors, std::string_view bytes,
                    const ReadBeside& read_beside = {});
// Reads FILE.glb or FILE.gltf with the files that it names beside it.
GltfScene ReadGltf(const std::filesystem::path& path);

}  // namespace likeness
