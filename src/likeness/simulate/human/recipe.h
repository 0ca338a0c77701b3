// What makes one person: the shape of the head, skin, hair and eyes.

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>

namespace likeness {

// All fields are keys of the TOML file of the same name; numbers without a unit are in [0, 1].
struct HumanRecipe {
  std::string name = "human";  // what Head::name() says
  uint64_t seed = 0;           // of moles, mottling, hairs: everything random in the textures
  int texture_size = 1024;     // texels a side of the skin's maps: 256 ... 4096

  // Shape. Ancestries are mixed in proportion.
  double african = 0, asian = 0, caucasian = 1;
  double male = 0.5;    // 0 female ... 1 male
  double age = 0.2;     // 0 about 25 years ... 1 about 90
  double muscle = 0.5;  // 0.5 average
  double weight = 0.5;  // 0.5 average
  // Weights of local shapes in [-1, 1] by LocalShape::name; positive is the shape's second suffix.
  std::map<std::string, double> local;

  // Skin: concentrations that its colour follows from.
  double melanin = 0.2;      // 0 very pale ... 1 very dark
  double haemoglobin = 0.5;  // blood under the skin
  double redness = 0.3;      // of cheeks, nose, ears, over the rest
  double freckles = 0;
  double moles = 0.3;
  double oiliness = 0.4;  // 0 matt ... 1 shiny

  // Hair.
  double hair_melanin = 0.7;  // 0 light blond ... 1 black
  double hair_redness = 0.2;  // 0 ash ... 1 ginger
  double grey = 0;
  double scalp_hair = 0.9;   // 0 shaved ... 1 dense cropped
  double hair_length = 0.4;  // 0 about a millimetre ... 1 about four
  double hairline = 0.3;     // 0 low ... 1 receding
  double brows = 0.6;        // how dense and wide
  double stubble = 0;

  // Iris: 0 blue ... 0.5 green and hazel ... 1 dark brown.
  double iris = 0.4;

  bool operator==(const HumanRecipe&) const = default;
  // Throws Error when a field is out of its range or a local shape is unknown.
  void Check(const std::string& what) const;
};

// A pair of opposite targets, "FOLDER/NAME-NEGATIVE.target.gz" and "FOLDER/NAME-POSITIVE.target.gz"; with `paired`
// there is one for each side, "l-" and "r-" before the name.
struct LocalShape {
  const char* name;
  const char* folder;
  const char* negative;
  const char* positive;
  bool paired;
  double spread;  // standard deviation of random people's weights
};
std::span<const LocalShape> LocalShapes();

// A plausible adult; the same for the same seed everywhere.
HumanRecipe RecipeFromSeed(uint64_t seed);

// Keys are HumanRecipe's fields; [local] holds local shapes. `from_seed = N` starts from a random person, other keys
// change it. Throws Error, naming the file and the nearest known key, for unknown keys and values out of range.
HumanRecipe ReadRecipe(const std::filesystem::path& path);
HumanRecipe ParseRecipe(const std::filesystem::path& path_for_errors, std::string_view text);
std::string RecipeText(const HumanRecipe& recipe);
void WriteRecipe(const std::filesystem::path& path, const HumanRecipe& recipe);

}  // namespace likeness
