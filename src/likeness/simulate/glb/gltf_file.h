// The outer shell of glTF 2.0 files: GLB container or JSON text, buffers, data URIs, files beside it. What comes out is
// tinygltf's model whose buffers have the lengths that they claim; nothing else of it has been checked.

#pragma once

#include <tiny_gltf.h>

#include <filesystem>
#include <string_view>

#include "likeness/simulate/glb/read_beside.h"

namespace likeness {

// Images stay encoded: model.images[i].image holds the bytes of a picture file. The fallback buffers of
// EXT_meshopt_compression are replaced by a few bytes. Throws Error for what is no glTF 2.0, for required extensions
// other than
//   EXT_meshopt_compression, EXT_texture_webp, KHR_mesh_quantization, KHR_texture_transform, KHR_materials_*
// and for buffers and images that lie about their length.
//   read_beside  files are refused when it is empty
tinygltf::Model ParseGltfFile(const std::filesystem::path& path_for_errors, std::string_view bytes,
                              const ReadBeside& read_beside);

}  // namespace likeness
