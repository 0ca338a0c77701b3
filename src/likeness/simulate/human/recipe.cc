#include "likeness/simulate/human/recipe.h"

#define TOML_EXCEPTIONS 1
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/random.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

constexpr LocalShape kLocalShapes[] = {
    {"head-age", "head", "decr", "incr", false, 0.10},
    {"head-angle", "head", "in", "out", false, 0.12},
    {"head-back-scale-depth", "head", "decr", "incr", false, 0.2},
    {"head-fat", "head", "decr", "incr", false, 0.2},
    {"head-scale-depth", "head", "decr", "incr", false, 0.15},
    {"head-scale-horiz", "head", "decr", "incr", false, 0.15},
    {"head-scale-vert", "head", "decr", "incr", false, 0.15},
    {"nose-base", "nose", "down", "up", false, 0.2},
    {"nose-compression", "nose", "compress", "uncompress", false, 0.15},
    {"nose-curve", "nose", "concave", "convex", false, 0.2},
    {"nose-flaring", "nose", "decr", "incr", false, 0.2},
    {"nose-greek", "nose", "decr", "incr", false, 0.15},
    {"nose-hump", "nose", "decr", "incr", false, 0.2},
    {"nose-nostrils-angle", "nose", "down", "up", false, 0.2},
    {"nose-nostrils-width", "nose", "decr", "incr", false, 0.2},
    {"nose-point", "nose", "down", "up", false, 0.2},
    {"nose-point-width", "nose", "decr", "incr", false, 0.2},
    {"nose-scale-depth", "nose", "decr", "incr", false, 0.15},
    {"nose-scale-horiz", "nose", "decr", "incr", false, 0.15},
    {"nose-scale-vert", "nose", "decr", "incr", false, 0.15},
    {"nose-septumangle", "nose", "decr", "incr", false, 0.15},
    {"nose-trans", "nose", "down", "up", false, 0.1},
    {"nose-volume", "nose", "decr", "incr", false, 0.15},
    {"nose-width1", "nose", "decr", "incr", false, 0.2},
    {"nose-width2", "nose", "decr", "incr", false, 0.2},
    {"nose-width3", "nose", "decr", "incr", false, 0.2},
    {"mouth-angles", "mouth", "down", "up", false, 0.12},
    {"mouth-cupidsbow", "mouth", "decr", "incr", false, 0.25},
    {"mouth-cupidsbow-width", "mouth", "decr", "incr", false, 0.2},
    {"mouth-laugh-lines", "mouth", "in", "out", false, 0.15},
    {"mouth-lowerlip-height", "mouth", "decr", "incr", false, 0.2},
    {"mouth-lowerlip-middle", "mouth", "down", "up", false, 0.1},
    {"mouth-lowerlip-volume", "mouth", "decr", "incr", false, 0.2},
    {"mouth-lowerlip-width", "mouth", "decr", "incr", false, 0.15},
    {"mouth-philtrum-volume", "mouth", "decr", "incr", false, 0.2},
    {"mouth-scale-depth", "mouth", "decr", "incr", false, 0.15},
    {"mouth-scale-horiz", "mouth", "decr", "incr", false, 0.2},
    {"mouth-trans", "mouth", "down", "up", false, 0.1},
    {"mouth-upperlip-height", "mouth", "decr", "incr", false, 0.2},
    {"mouth-upperlip-volume", "mouth", "decr", "incr", false, 0.2},
    {"mouth-upperlip-width", "mouth", "decr", "incr", false, 0.15},
    {"chin-bones", "chin", "decr", "incr", false, 0.2},
    {"chin-cleft", "chin", "decr", "incr", false, 0.2},
    {"chin-height", "chin", "decr", "incr", false, 0.15},
    {"chin-jaw-drop", "chin", "decr", "incr", false, 0.15},
    {"chin-prognathism", "chin", "decr", "incr", false, 0.1},
    {"chin-prominent", "chin", "decr", "incr", false, 0.2},
    {"chin-width", "chin", "decr", "incr", false, 0.2},
    {"cheek-bones", "cheek", "decr", "incr", true, 0.2},
    {"cheek-inner", "cheek", "decr", "incr", true, 0.2},
    {"cheek-trans", "cheek", "down", "up", true, 0.15},
    {"cheek-volume", "cheek", "decr", "incr", true, 0.2},
    {"ear-flap", "ears", "decr", "incr", true, 0.2},
    {"ear-lobe", "ears", "decr", "incr", true, 0.25},
    {"ear-rot", "ears", "backward", "forward", true, 0.15},
    {"ear-scale", "ears", "decr", "incr", true, 0.15},
    {"ear-wing", "ears", "decr", "incr", true, 0.15},
    {"eye-bag", "eyes", "decr", "incr", true, 0.15},
    {"eye-corner1", "eyes", "down", "up", true, 0.15},
    {"eye-corner2", "eyes", "down", "up", true, 0.15},
    {"eye-eyefold", "eyes", "down", "up", true, 0.1},
    {"eye-eyefold-angle", "eyes", "down", "up", true, 0.15},
    {"eye-height1", "eyes", "decr", "incr", true, 0.12},
    {"eye-height2", "eyes", "decr", "incr", true, 0.12},
    {"eye-height3", "eyes", "decr", "incr", true, 0.12},
    {"eye-trans", "eyes", "in", "out", true, 0.1},
    {"eyebrows-angle", "eyebrows", "down", "up", false, 0.2},
    {"eyebrows-trans", "eyebrows", "down", "up", false, 0.15},
    {"forehead-nubian", "forehead", "decr", "incr", false, 0.15},
    {"forehead-scale-vert", "forehead", "decr", "incr", false, 0.15},
    {"forehead-temple", "forehead", "decr", "incr", false, 0.15},
    {"forehead-trans", "forehead", "backward", "forward", false, 0.1},
    {"neck-double", "neck", "decr", "incr", false, 0.1},
    {"neck-scale-horiz", "neck", "decr", "incr", false, 0.15},
    {"asym-brown-1", "asym", "l", "r", false, 0.3},
    {"asym-cheek-1", "asym", "l", "r", false, 0.3},
    {"asym-ear-1", "asym", "l", "r", false, 0.3},
    {"asym-eye-1", "asym", "l", "r", false, 0.25},
    {"asym-jaw-1", "asym", "l", "r", false, 0.25},
    {"asym-mouth-1", "asym", "l", "r", false, 0.25},
    {"asym-nose-1", "asym", "l", "r", false, 0.25},
    {"asym-temple-1", "asym", "l", "r", false, 0.25},
};

// Every number of a recipe with its name: one list for reading, writing and checking.
template <typename Recipe, typename Visit>
void VisitFractions(Recipe& r, const Visit& visit) {
  visit("african", r.african);
  visit("asian", r.asian);
  visit("caucasian", r.caucasian);
  visit("male", r.male);
  visit("age", r.age);
  visit("muscle", r.muscle);
  visit("weight", r.weight);
  visit("melanin", r.melanin);
  visit("haemoglobin", r.haemoglobin);
  visit("redness", r.redness);
  visit("freckles", r.freckles);
  visit("moles", r.moles);
  visit("oiliness", r.oiliness);
  visit("hair_melanin", r.hair_melanin);
  visit("hair_redness", r.hair_redness);
  visit("grey", r.grey);
  visit("scalp_hair", r.scalp_hair);
  visit("hair_length", r.hair_length);
  visit("hairline", r.hairline);
  visit("brows", r.brows);
  visit("stubble", r.stubble);
  visit("iris", r.iris);
}

std::vector<std::string> LocalNames() {
  std::vector<std::string> names;
  for (const LocalShape& shape : kLocalShapes) names.emplace_back(shape.name);
  return names;
}

std::string Nearest(std::string_view word, const std::vector<std::string>& known) {
  const std::string nearest = NearestWord(word, known);
  return nearest.empty() ? "" : fmt::format("; the nearest is '{}'", nearest);
}

[[noreturn]] void Fail(const std::filesystem::path& path, const toml::node& node, const std::string& message) {
  throw FileError(path, static_cast<int>(node.source().begin.line), message);
}

double Number(const std::filesystem::path& path, std::string_view key, const toml::node& node) {
  const auto value = node.is_number() ? node.value<double>() : std::nullopt;
  if (!value || !std::isfinite(*value)) Fail(path, node, fmt::format("'{}' must be a finite number", key));
  return *value;
}

int64_t Integer(const std::filesystem::path& path, std::string_view key, const toml::node& node) {
  if (!node.is_integer()) Fail(path, node, fmt::format("'{}' must be a whole number", key));
  return *node.value<int64_t>();
}

uint64_t Seed(const std::filesystem::path& path, std::string_view key, const toml::node& node) {
  const int64_t value = Integer(path, key, node);
  if (value < 0) Fail(path, node, fmt::format("'{}' must not be negative", key));
  return static_cast<uint64_t>(value);
}

}  // namespace

std::span<const LocalShape> LocalShapes() { return kLocalShapes; }

void HumanRecipe::Check(const std::string& what) const {
  VisitFractions(*this, [&](const char* key, double value) {
    if (!(value >= 0 && value <= 1)) throw Error("{}: '{}' is {}, expected a number in [0, 1]", what, key, value);
  });
  if (seed >> 63 != 0) throw Error("{}: 'seed' is {}, expected less than 2^63, TOML's largest number", what, seed);
  if (african + asian + caucasian <= 0) throw Error("{}: one of african, asian and caucasian must be above 0", what);
  if (texture_size < 256 || texture_size > 4096) {
    throw Error("{}: 'texture_size' is {}, expected 256 to 4096", what, texture_size);
  }
  const auto names = LocalNames();
  for (const auto& [key, value] : local) {
    if (std::find(names.begin(), names.end(), key) == names.end()) {
      throw Error("{}: '{}' is no local shape{}", what, key, Nearest(key, names));
    }
    if (!(std::abs(value) <= 1)) throw Error("{}: local shape '{}' is {}, expected [-1, 1]", what, key, value);
  }
}

HumanRecipe RecipeFromSeed(uint64_t seed) {
  // Streams keep the parts apart: a new field of the skin does not change anybody's nose.
  Random shape(Hash({seed, 1})), skin(Hash({seed, 2})), hair(Hash({seed, 3}));
  HumanRecipe r;
  r.name = fmt::format("human:{}", seed);
  r.seed = seed;
  // One main ancestry and a little of the others.
  double* const ancestries[] = {&r.african, &r.asian, &r.caucasian};
  r.african = shape.Uniform(0, 0.2);
  r.asian = shape.Uniform(0, 0.2);
  r.caucasian = shape.Uniform(0, 0.2);
  *ancestries[shape.Below(3)] = 1;
  const double sum = r.african + r.asian + r.caucasian;
  for (double* ancestry : ancestries) *ancestry /= sum;
  const bool is_male = shape.Uniform() < 0.5;
  r.male = is_male ? shape.Uniform(0.8, 1) : shape.Uniform(0, 0.15);
  r.age = 0.6 * std::pow(shape.Uniform(), 1.5);
  r.muscle = shape.Uniform(0.35, 0.7);
  r.weight = std::clamp(0.5 + 0.12 * shape.Normal(), 0.2, 0.8);
  for (const LocalShape& local : kLocalShapes) {
    r.local[local.name] = std::clamp(local.spread * shape.Normal(), -2 * local.spread, 2 * local.spread);
  }

  const double mean_melanin = 0.72 * r.african + 0.3 * r.asian + 0.16 * r.caucasian;
  r.melanin = std::clamp(mean_melanin * (1 + 0.2 * skin.Normal()), 0.05, 0.95);
  r.haemoglobin = std::clamp(0.5 + 0.12 * skin.Normal(), 0.2, 0.8);
  r.redness = skin.Uniform(0.15, 0.6);
  r.freckles = r.melanin < 0.25 && skin.Uniform() < 0.35 ? skin.Uniform(0.2, 1) : skin.Uniform(0, 0.1);
  r.moles = skin.Uniform(0.1, 0.7);
  r.oiliness = skin.Uniform(0.2, 0.7);

  r.hair_melanin = r.caucasian > 0.5 ? hair.Uniform(0.25, 1) : hair.Uniform(0.85, 1);
  r.hair_redness = hair.Uniform(0, r.caucasian > 0.5 ? 0.8 : 0.3);
  r.grey = std::clamp((r.age - 0.25) * hair.Uniform(0.5, 2.5), 0.0, 1.0);
  r.scalp_hair = is_male ? hair.Uniform(0.75, 1) : hair.Uniform(0.9, 1);
  r.hair_length = hair.Uniform(0.15, 1);
  r.hairline = is_male ? std::clamp(hair.Uniform(0.1, 0.5) + 0.5 * r.age, 0.0, 1.0) : hair.Uniform(0, 0.25);
  r.brows = is_male ? hair.Uniform(0.55, 1) : hair.Uniform(0.35, 0.7);
  r.stubble = is_male ? hair.Uniform(0.1, 0.9) : 0;
  r.iris = r.caucasian > 0.5 ? hair.Uniform(0, 1) : hair.Uniform(0.8, 1);
  return r;
}

HumanRecipe ReadRecipe(const std::filesystem::path& path) { return ParseRecipe(path, ReadFile(path, 1 << 20)); }

HumanRecipe ParseRecipe(const std::filesystem::path& path, std::string_view text) {
  toml::table table;
  try {
    table = toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw FileError(path, static_cast<int>(error.source().begin.line), std::string(error.description()));
  }
  HumanRecipe recipe;
  recipe.name = "human:" + path.stem().string();
  if (const toml::node* from = table.get("from_seed")) {
    const std::string name = recipe.name;
    recipe = RecipeFromSeed(Seed(path, "from_seed", *from));
    recipe.name = name;
  }
  std::vector<std::string> keys = {"from_seed", "seed", "texture_size", "name", "local"};
  std::map<std::string, double*, std::less<>> fractions;
  VisitFractions(recipe, [&](const char* key, double& value) {
    fractions[key] = &value;
    keys.emplace_back(key);
  });
  for (const auto& [toml_key, node] : table) {
    const std::string key(std::string_view{toml_key});
    if (key == "from_seed") continue;
    if (key == "seed") {
      recipe.seed = Seed(path, key, node);
    } else if (key == "texture_size") {
      recipe.texture_size = static_cast<int>(std::clamp<int64_t>(Integer(path, key, node), -1, 1 << 20));
    } else if (key == "name") {
      if (!node.is_string()) Fail(path, node, "'name' must be text in quotes");
      recipe.name = *node.value<std::string>();
    } else if (key == "local") {
      const toml::table* local = node.as_table();
      if (local == nullptr) Fail(path, node, "'local' must be a table of local shapes");
      for (const auto& [name, weight] : *local) {
        recipe.local[std::string(std::string_view{name})] = Number(path, std::string_view{name}, weight);
      }
    } else if (const auto found = fractions.find(key); found != fractions.end()) {
      *found->second = Number(path, key, node);
    } else {
      Fail(path, node, fmt::format("unknown key '{}'{}", key, Nearest(key, keys)));
    }
  }
  recipe.Check(path.string());
  return recipe;
}

std::string RecipeText(const HumanRecipe& recipe) {
  toml::table table;
  table.insert("name", recipe.name);
  table.insert("seed", static_cast<int64_t>(recipe.seed));
  table.insert("texture_size", recipe.texture_size);
  VisitFractions(recipe, [&](const char* key, double value) { table.insert(key, value); });
  toml::table local;
  for (const auto& [name, weight] : recipe.local) local.insert(name, weight);
  table.insert("local", local);
  std::ostringstream text;
  text << table << "\n";
  return text.str();
}

void WriteRecipe(const std::filesystem::path& path, const HumanRecipe& recipe) { WriteFile(path, RecipeText(recipe)); }

}  // namespace likeness
