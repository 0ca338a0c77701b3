#include "likeness/simulate/glb/shape_names.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "likeness/base/error.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

bool IsSeparator(char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }

std::string LettersOf(std::string_view name) {
  std::string letters;
  for (const char c : name) {
    if (!IsSeparator(c)) letters += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return letters;
}

// Every accepted spelling without separators.
const std::map<std::string, int, std::less<>>& Spellings() {
  static const auto spellings = [] {
    std::map<std::string, int, std::less<>> all;
    for (int k = 0; k < kExpressionCount; ++k) {
      const std::string letters = LettersOf(ExpressionNames()[k]);
      all[letters] = k;
      for (const std::string side : {"left", "right"}) {
        if (letters.ends_with(side)) all[letters.substr(0, letters.size() - side.size() + 1)] = k;
      }
    }
    return all;
  }();
  return spellings;
}

// What remains of a name when words in front are dropped one by one, the whole name first.
std::vector<std::string_view> Endings(std::string_view name) {
  std::vector<std::string_view> endings = {name};
  for (size_t i = 0; i + 1 < name.size(); ++i) {
    if (IsSeparator(name[i]) && !IsSeparator(name[i + 1])) endings.push_back(name.substr(i + 1));
  }
  return endings;
}

}  // namespace

int ExpressionFromName(std::string_view name) {
  for (const std::string_view ending : Endings(name)) {
    const auto found = Spellings().find(LettersOf(ending));
    if (found != Spellings().end()) return found->second;
  }
  return -1;
}

ShapeMap ParseShapeMap(const std::filesystem::path& path_for_errors, std::string_view text) {
  using nlohmann::json;
  constexpr int kDeepest = 8;
  const auto shallow = [](int depth, json::parse_event_t, json&) { return depth <= kDeepest; };
  const json document = json::parse(text.begin(), text.end(), shallow, /*allow_exceptions=*/false);
  if (!document.is_object()) {
    throw FileError(path_for_errors, "is no shape map: expected JSON, {\"JawOpen\": {\"target\": weight}, ...}");
  }
  ShapeMap map;
  for (const auto& [name, targets] : document.items()) {
    const int expression = ExpressionFromName(name);
    if (expression < 0) {
      std::string nearest = NearestWord(name, {ExpressionNames().begin(), ExpressionNames().end()});
      if (!nearest.empty()) nearest = fmt::format("; the nearest is '{}'", nearest);
      throw FileError(path_for_errors, fmt::format("'{}' is no ARKit expression{}", name, nearest));
    }
    if (!targets.is_object()) {
      throw FileError(path_for_errors, fmt::format("'{}': expected {{\"target\": weight, ...}}", name));
    }
    for (const auto& [target, weight] : targets.items()) {
      if (!weight.is_number() || !(std::abs(weight.get<double>()) <= 100)) {
        throw FileError(path_for_errors, fmt::format("'{}': the weight of '{}' is no number up to 100", name, target));
      }
      map.terms[expression].push_back({target, weight.get<float>()});
    }
  }
  return map;
}

std::array<std::vector<ShapeTerm>, kExpressionCount> MatchShapes(const std::vector<std::string>& target_names,
                                                                 const ShapeMap& map) {
  std::map<std::string, int> by_ending;  // the longest ending wins: whole names first
  size_t most_words = 0;
  std::vector<std::vector<std::string_view>> endings;
  for (const std::string& name : target_names) {
    endings.push_back(Endings(name));
    most_words = std::max(most_words, endings.back().size());
  }
  for (size_t dropped = 0; dropped < most_words; ++dropped) {
    for (size_t t = 0; t < target_names.size(); ++t) {
      if (dropped < endings[t].size()) by_ending.try_emplace(std::string(endings[t][dropped]), static_cast<int>(t));
    }
  }
  std::array<std::vector<ShapeTerm>, kExpressionCount> shapes;
  for (int k = 0; k < kExpressionCount; ++k) {
    for (const ShapeMap::Term& term : map.terms[k]) {
      const auto found = by_ending.find(term.target);
      if (found != by_ending.end()) shapes[k].push_back({found->second, term.weight});
    }
  }
  for (size_t t = 0; t < target_names.size(); ++t) {
    const int k = ExpressionFromName(target_names[t]);
    if (k >= 0 && map.terms[k].empty() && shapes[k].empty()) shapes[k].push_back({static_cast<int>(t), 1});
  }
  return shapes;
}

}  // namespace likeness
