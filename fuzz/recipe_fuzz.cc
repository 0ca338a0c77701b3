#include "fuzz.h"
#include "likeness/simulate/human/recipe.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  CheckRoundTrip(
      bytes, [](std::string_view text) { return ParseRecipe(kPath, text); }, RecipeText);
}

}  // namespace likeness
