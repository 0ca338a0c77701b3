// How the surfaces of a model answer to light: its own textures, with sensible values for what glTF leaves open.

#pragma once

#include <filesystem>

#include "likeness/simulate/glb/gltf_scene.h"
#include "likeness/simulate/glb/part_kind.h"
#include "likeness/simulate/head.h"

namespace likeness {

// A texture of the base colour becomes the albedo (times the material's colour; with alpha where the material is not
// opaque), a normal texture the normal map, green of a metallic-roughness texture the roughness. A constant roughness
// is replaced by one that fits the kind of part, as scatter, wetness and the specular reflectance are: skin scatters,
// eyes and teeth are wet, lashes and clear parts of eyes cast no shadow. Metal is ignored.
//   material  index into the scene's; -1: grey
// Throws Error, naming the file, for damaged pictures.
Material MakeMaterial(const std::filesystem::path& path_for_errors, const GltfScene& scene, int material,
                      PartKind kind);

}  // namespace likeness
