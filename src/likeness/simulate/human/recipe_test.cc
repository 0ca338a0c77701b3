#include "likeness/simulate/human/recipe.h"

#include <gtest/gtest.h>

#include "likeness/base/file.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

HumanRecipe Read(const std::string& text) {
  const ScratchFolder folder;
  WriteFile(folder / "ann.toml", text);
  return ReadRecipe(folder / "ann.toml");
}

// The error's text behind the folder's name.
std::string ReadError(const std::string& text) {
  const std::string error = ErrorOf([&] { Read(text); });
  const size_t name = error.find("ann.toml");
  return name == std::string::npos ? error : error.substr(name);
}

TEST(Recipe, SeedsGiveTheSamePersonAgainAndDifferentPeopleApart) {
  EXPECT_EQ(RecipeFromSeed(7), RecipeFromSeed(7));
  EXPECT_FALSE(RecipeFromSeed(7) == RecipeFromSeed(8));
  for (uint64_t seed = 0; seed < 200; ++seed) {
    const HumanRecipe recipe = RecipeFromSeed(seed);
    EXPECT_EQ(ErrorOf([&] { recipe.Check("recipe"); }), "");
    EXPECT_LE(recipe.age, 0.6) << "adults, none at the far end of old age";
    EXPECT_GE(recipe.local.size(), 60u);
  }
}

TEST(Recipe, ComesBackFromAFile) {
  const ScratchFolder folder;
  HumanRecipe recipe = RecipeFromSeed(12);
  recipe.name = "somebody \"quoted\"";
  WriteRecipe(folder / "a.toml", recipe);
  EXPECT_EQ(ReadRecipe(folder / "a.toml"), recipe);
}

TEST(Recipe, StartsFromASeedAndIsNamedAfterItsFile) {
  HumanRecipe expected = RecipeFromSeed(3);
  expected.name = "human:ann";
  expected.melanin = 0.5;
  expected.local["nose-hump"] = -0.25;
  EXPECT_EQ(Read("from_seed = 3\nmelanin = 0.5\n[local]\nnose-hump = -0.25\n"), expected);
  EXPECT_EQ(Read("").name, "human:ann");
}

TEST(Recipe, SaysWhatIsWrongAndWhere) {
  EXPECT_EQ(ReadError("\nmelanine = 0.5\n"), "ann.toml:2: unknown key 'melanine'; the nearest is 'melanin'");
  EXPECT_EQ(ReadError("[local]\nnose-hamp = 0.5\n"),
            "ann.toml: 'nose-hamp' is no local shape; the nearest is 'nose-hump'");
  EXPECT_EQ(ReadError("melanin = 1.5\n"), "ann.toml: 'melanin' is 1.5, expected a number in [0, 1]");
  EXPECT_EQ(ReadError("melanin = nan\n"), "ann.toml:1: 'melanin' must be a finite number");
  EXPECT_EQ(ReadError("melanin = 'much'\n"), "ann.toml:1: 'melanin' must be a finite number");
  EXPECT_EQ(ReadError("seed = -1\n"), "ann.toml:1: 'seed' must not be negative");
  EXPECT_EQ(ReadError("texture_size = 1000000000000\n"), "ann.toml: 'texture_size' is 1048576, expected 256 to 4096");
  EXPECT_EQ(ReadError("caucasian = 0\n"), "ann.toml: one of african, asian and caucasian must be above 0");
  EXPECT_EQ(ReadError("local = 3\n"), "ann.toml:1: 'local' must be a table of local shapes");
  EXPECT_NE(ErrorOf([] { RecipeFromSeed(~uint64_t{0}).Check("x"); }).find("expected less than 2^63"),
            std::string::npos);
  EXPECT_NE(ReadError("melanin = \n"), "");
  EXPECT_NE(ReadError("melanin = 0.5\n\xff\xfe\n"), "");
}

}  // namespace
}  // namespace likeness
