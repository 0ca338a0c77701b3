// A head from a glTF 2.0 model with morph targets (GLB or .gltf), as avatar makers export them.

#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "likeness/simulate/glb/read_beside.h"
#include "likeness/simulate/head.h"

namespace likeness {

// Skin, hair, teeth and tongue move linearly with the weights, as the morph targets say; lids that would cut into an
// eye slide over it; eyes turn about their centres where the model has no shapes for that. Of bodies head and neck are
// kept. The tracked mesh is the face's connected skin with holes closed (see closed_surface.h and surface_atlas.h).
//   model      FILE.glb or FILE.gltf
//   shape_map  JSON that names morph targets (see shape_names.h); empty: by their ARKit names alone
// Throws Error for damaged files, and for models without a face that moves. Says once in the log which expressions are
// missing.
std::unique_ptr<Head> ReadGlbHead(const std::filesystem::path& model, const std::filesystem::path& shape_map = {});

// The same from memory.
std::unique_ptr<Head> ParseGlbHead(const std::filesystem::path& path_for_errors, std::string_view bytes,
                                   const ReadBeside& read_beside, std::string_view shape_map_json);

}  // namespace likeness
