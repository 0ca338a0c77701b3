#include "likeness/simulate/open_head.h"

#include <cctype>
#include <charconv>
#include <cstdlib>
#include <system_error>
#include <vector>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/random.h"
#include "likeness/simulate/glb/glb_head.h"
#include "likeness/simulate/human/human_head.h"
#include "likeness/simulate/procedural_head.h"

namespace likeness {
namespace {

uint64_t ReadSeed(const std::string& spec, const std::string& text) {
  uint64_t seed = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seed);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw Error("head '{}': '{}' is no seed, expected a whole number", spec, text);
  }
  return seed;
}

HumanRecipe ReadHumanRecipe(const std::string& spec, const std::string& detail) {
  if (detail.empty()) throw Error("head '{}': expected human:SEED or human:FILE.toml", spec);
  if (detail.ends_with(".toml")) return ReadRecipe(detail);
  return RecipeFromSeed(ReadSeed(spec, detail));
}

bool IsModelFile(const std::string& spec) {
  std::string ending = std::filesystem::path(spec).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending == ".glb" || ending == ".gltf";
}

// A model is named by its content: the file may be elsewhere the next time.
std::string DescribeModel(const std::filesystem::path& model, const std::filesystem::path& shape_map) {
  std::string text = fmt::format("model_hash = \"{:016x}\"\n", Hash(ReadFile(model)));
  if (!shape_map.empty()) text += fmt::format("shape_map_hash = \"{:016x}\"\n", Hash(ReadFile(shape_map)));
  return text;
}

}  // namespace

std::filesystem::path FindHeadData(const std::filesystem::path& given) {
  std::vector<std::filesystem::path> places;
  if (!given.empty()) {
    places = {given};
  } else {
    if (const char* variable = std::getenv("LIKENESS_HEAD_DATA"); variable != nullptr && *variable != 0) {
      places.emplace_back(variable);
    }
    places.emplace_back(".deps/head-data");
    std::error_code error;
    const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
    // Installed, and in a build folder of the checkout.
    for (const char* place : {"../share/likeness/head-data", "../../.deps/head-data"}) {
      if (!error) places.push_back((program.parent_path() / place).lexically_normal());
    }
  }
  std::string searched;
  for (const std::filesystem::path& place : places) {
    if (std::filesystem::is_directory(place / "mpfb2")) return place;
    searched += (searched.empty() ? "" : ", ") + place.string();
  }
  throw Error(
      "there are no MakeHuman head data (searched {}): run scripts/setup, name them with --head-data, or use --head "
      "procedural",
      searched);
}

OpenedHead OpenHead(const std::string& spec, const std::filesystem::path& head_data,
                    const std::filesystem::path& shape_map) {
  if (IsModelFile(spec)) return {ReadGlbHead(spec, shape_map), DescribeModel(spec, shape_map)};
  if (!shape_map.empty()) throw Error("head '{}' takes no shape map: only FILE.glb and FILE.gltf do", spec);
  const size_t colon = spec.find(':');
  const std::string kind = spec.substr(0, colon);
  const std::string detail = colon == std::string::npos ? "" : spec.substr(colon + 1);
  if (kind == "human") {
    const HumanRecipe recipe = ReadHumanRecipe(spec, detail);
    return {MakeHumanHead(FindHeadData(head_data), recipe), RecipeText(recipe)};
  }
  if (kind == "procedural" || kind == "plain") {
    ProceduralOptions options;
    options.plain = kind == "plain";
    options.seed = detail.empty() ? 0 : ReadSeed(spec, detail);
    return {MakeProceduralHead(options), ""};
  }
  throw Error("there is no head '{}', expected human:SEED, human:FILE.toml, FILE.glb, procedural or plain", spec);
}

}  // namespace likeness
