#include "likeness/avatar/arkit_map.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/json.h"

namespace likeness {
namespace {

constexpr char kKey[] = "arkit", kBias[] = "arkit.bias", kWeights[] = "arkit.weight";
constexpr int kVersion = 1;

void CheckFinite(const std::string& what, const std::vector<float>& values) {
  if (!std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); })) {
    throw Error("{}: the ARKit map holds values that are not finite", what);
  }
}

// {"version": 1, "coefficients": ["eyeBlinkLeft", ...], "terms": [["jawOpen"], ["jawOpen", "mouthFunnel"], ...]}
std::string DescribeTerms(const ArkitMap& map) {
  nlohmann::json terms = nlohmann::json::array();
  for (const ArkitTerm& term : map.terms) {
    nlohmann::json names = {map.coefficients[term[0]]};
    if (term[1] >= 0) names.push_back(map.coefficients[term[1]]);
    terms.push_back(names);
  }
  return nlohmann::json{{"version", kVersion}, {"coefficients", map.coefficients}, {"terms", terms}}.dump();
}

int IndexOf(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) throw Error("'{}' is none of its coefficients", name);
  return static_cast<int>(found - names.begin());
}

void ParseTerms(const nlohmann::json& json, ArkitMap* map) {
  if (json.at("version") != kVersion) {
    throw Error("is of version {}; this program reads version {}: fit it again with likeness fit-arkit",
                json.at("version").dump(), kVersion);
  }
  map->coefficients = json.at("coefficients").get<std::vector<std::string>>();
  for (const auto& names : json.at("terms").get<std::vector<std::vector<std::string>>>()) {
    if (names.empty() || names.size() > 2) throw Error("a term is one coefficient or two, not {}", names.size());
    const int second = names.size() == 2 ? IndexOf(map->coefficients, names[1]) : -1;
    map->terms.push_back({IndexOf(map->coefficients, names[0]), second});
  }
}

}  // namespace

std::vector<double> TermValues(const std::vector<ArkitTerm>& terms, std::span<const float> values) {
  std::vector<double> results;
  for (const auto& [first, second] : terms) {
    results.push_back(static_cast<double>(values[first]) * (second < 0 ? 1.0 : static_cast<double>(values[second])));
  }
  return results;
}

std::vector<float> ArkitMap::CodeOf(std::span<const float> values) const {
  LIKENESS_CHECK(values.size() == coefficients.size());
  const std::vector<double> inputs = TermValues(terms, values);
  std::vector<float> code(bias.size());
  for (size_t i = 0; i < code.size(); ++i) {
    double sum = bias[i];
    for (size_t k = 0; k < inputs.size(); ++k) sum += weights[i * inputs.size() + k] * inputs[k];
    code[i] = static_cast<float>(sum);
  }
  return code;
}

void ArkitMap::Check(const std::string& what, int latent) const {
  const std::set<std::string> names(coefficients.begin(), coefficients.end());
  if (names.size() != coefficients.size()) throw Error("{}: the ARKit map names a coefficient twice", what);
  const auto count = static_cast<int>(coefficients.size());
  for (const auto& [first, second] : terms) {
    if (first < 0 || first >= count || second < -1 || second >= count) {
      throw Error("{}: a term of the ARKit map is no coefficient and no product of two", what);
    }
  }
  const auto codes = static_cast<size_t>(latent);
  if (bias.size() != codes || weights.size() != codes * terms.size()) {
    throw Error("{}: the ARKit map has {} biases and {} weights; expected {} and {}", what, bias.size(), weights.size(),
                codes, codes * terms.size());
  }
  CheckFinite(what, bias);
  CheckFinite(what, weights);
}

std::optional<ArkitMap> ReadArkitMap(const SafetensorsFile& file, int latent) {
  if (!file.metadata().contains(kKey)) return std::nullopt;
  const std::string where = fmt::format("{}: metadata '{}'", file.path().string(), kKey);
  ArkitMap map;
  try {
    ParseTerms(ParseJson(where, file.Metadata(kKey)), &map);
  } catch (const nlohmann::json::exception& error) {
    throw FileError(where, fmt::format("is not understood: {}", error.what()));
  } catch (const Error& error) {
    const std::string_view message = error.what();
    if (message.starts_with(where)) throw;
    throw FileError(where, error.what());
  }
  const auto terms = static_cast<int64_t>(map.terms.size());
  map.bias = file.Floats(kBias, {latent});
  map.weights = file.Floats(kWeights, {latent, terms});
  map.Check(file.path().string(), latent);
  return map;
}

void WriteWithArkitMap(const std::filesystem::path& path, const SafetensorsFile& file, const ArkitMap& map) {
  const auto latent = static_cast<int64_t>(map.bias.size()), terms = static_cast<int64_t>(map.terms.size());
  std::vector<TensorView> tensors;
  for (const std::string& name : file.names()) {
    if (name == kBias || name == kWeights) continue;
    tensors.push_back({name, file.DTypeOf(name), file.ShapeOf(name), file.Bytes(name)});
  }
  tensors.push_back(ViewOf(kBias, {latent}, map.bias));
  tensors.push_back(ViewOf(kWeights, {latent, terms}, map.weights));
  std::map<std::string, std::string> metadata = file.metadata();
  metadata[kKey] = DescribeTerms(map);
  WriteSafetensors(path, tensors, metadata);
}

}  // namespace likeness
