// Paints sclera, iris and pupil on the eyeball of eye.h.

#pragma once

#include "likeness/simulate/head.h"
#include "likeness/simulate/human/recipe.h"

namespace likeness {

// `side` 0 or 1 varies the pattern between both eyes of a person.
Material PaintEyeball(const HumanRecipe& recipe, int side);
Material CorneaMaterial();

}  // namespace likeness
