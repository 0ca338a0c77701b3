// A human head from MakeHuman's base mesh, its identity targets and 52 expression shapes, with skin, eyes, teeth and
// hair made here.

#pragma once

#include <filesystem>
#include <memory>

#include "likeness/simulate/head.h"
#include "likeness/simulate/human/recipe.h"

namespace likeness {

// The head's centre is between the ears at the height of the eyes (see Identity). Skin, mouth, lashes, teeth and tongue
// move linearly with the weights, except that lids slide over the eyes instead of cutting into them; eyes turn.
// Normal maps are in the frame of the surface's own uvs: x along growing u, y along growing v, z outwards.
//   data_folder  holds mpfb2/ and faceunits01/
// Throws Error when data are missing or wrong, or the recipe does not Check().
std::unique_ptr<Head> MakeHumanHead(const std::filesystem::path& data_folder, const HumanRecipe& recipe);

}  // namespace likeness
