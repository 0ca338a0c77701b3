#include "likeness/simulate/speech.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <string_view>
#include <utility>

#include "likeness/base/error.h"

namespace likeness {
namespace {

constexpr double kSecondsPerPhoneme = 0.09;

// A mouth shape: sides are raised together where a name has no side.
struct Viseme {
  double dominance = 1;
  std::vector<std::pair<std::string, double>> weights;
};

const std::map<std::string, Viseme, std::less<>>& Visemes() {
  static const auto table = [] {
    const Viseme rest{0.6, {}};
    const Viseme closed{2.5, {{"mouthClose", 0.06}, {"mouthPress", 0.45}, {"mouthRollLower", 0.25}, {"jawOpen", 0.03}}};
    const Viseme labiodental{2.2, {{"mouthRollLower", 0.5}, {"mouthUpperUp", 0.3}, {"jawOpen", 0.06}}};
    const Viseme dental{1.2, {{"jawOpen", 0.14}, {"tongueOut", 0.25}, {"mouthLowerDown", 0.2}}};
    const Viseme alveolar{0.8, {{"jawOpen", 0.12}, {"mouthLowerDown", 0.25}, {"mouthUpperUp", 0.12}}};
    const Viseme sibilant{1.3,
                          {{"jawOpen", 0.04}, {"mouthStretch", 0.35}, {"mouthLowerDown", 0.35}, {"mouthUpperUp", 0.2}}};
    const Viseme postalveolar{1.5, {{"mouthFunnel", 0.55}, {"jawOpen", 0.08}, {"mouthPucker", 0.2}}};
    const Viseme velar{0.6, {{"jawOpen", 0.16}, {"mouthStretch", 0.1}}};
    const Viseme rhotic{1.1, {{"mouthFunnel", 0.35}, {"mouthPucker", 0.3}, {"jawOpen", 0.12}}};
    const Viseme rounded{1.8, {{"mouthPucker", 0.75}, {"mouthFunnel", 0.25}, {"jawOpen", 0.08}}};
    const Viseme open{1.4, {{"jawOpen", 0.55}, {"mouthLowerDown", 0.3}, {"mouthUpperUp", 0.15}}};
    const Viseme open_front{1.3,
                            {{"jawOpen", 0.42}, {"mouthStretch", 0.3}, {"mouthUpperUp", 0.25}, {"mouthSmile", 0.15}}};
    const Viseme mid{1.0, {{"jawOpen", 0.27}, {"mouthLowerDown", 0.15}}};
    const Viseme open_rounded{1.5, {{"jawOpen", 0.42}, {"mouthFunnel", 0.5}}};
    const Viseme mid_rounded{1.5, {{"jawOpen", 0.24}, {"mouthFunnel", 0.4}, {"mouthPucker", 0.35}}};
    const Viseme spread{1.4, {{"jawOpen", 0.08}, {"mouthSmile", 0.4}, {"mouthStretch", 0.3}, {"mouthUpperUp", 0.1}}};
    const Viseme near_spread{1.0, {{"jawOpen", 0.17}, {"mouthSmile", 0.2}, {"mouthStretch", 0.15}}};
    return std::map<std::string, Viseme, std::less<>>{
        {"_", rest},          {"P", closed},        {"B", closed},       {"M", closed},       {"F", labiodental},
        {"V", labiodental},   {"TH", dental},       {"DH", dental},      {"T", alveolar},     {"D", alveolar},
        {"N", alveolar},      {"L", alveolar},      {"S", sibilant},     {"Z", sibilant},     {"SH", postalveolar},
        {"CH", postalveolar}, {"JH", postalveolar}, {"K", velar},        {"G", velar},        {"NG", velar},
        {"HH", velar},        {"R", rhotic},        {"ER", rhotic},      {"W", rounded},      {"UW", rounded},
        {"AA", open},         {"AY", open},         {"AW", open},        {"AE", open_front},  {"EH", open_front},
        {"AH", mid},          {"AO", open_rounded}, {"OW", mid_rounded}, {"UH", mid_rounded}, {"IY", spread},
        {"Y", spread},        {"EY", spread},       {"IH", near_spread},
    };
  }();
  return table;
}

std::vector<const Viseme*> VisemesOf(const Sentence& sentence) {
  std::vector<const Viseme*> visemes;
  std::istringstream words(sentence.phonemes);
  for (std::string word; words >> word;) {
    const auto found = Visemes().find(word);
    if (found == Visemes().end()) throw Error("sentence {} has an unknown phoneme '{}'", sentence.name, word);
    visemes.push_back(&found->second);
  }
  return visemes;
}

bool HasSides(std::string_view name) {
  static constexpr std::array<std::string_view, 6> kSided = {"mouthPress",   "mouthUpperUp", "mouthLowerDown",
                                                             "mouthStretch", "mouthSmile",   "mouthDimple"};
  return std::find(kSided.begin(), kSided.end(), name) != kSided.end();
}

}  // namespace

const std::vector<Sentence>& BuiltInSentences() {
  static const std::vector<Sentence> sentences = {
      {"SEN_the_boy_was_there_when_the_sun_rose", "_ DH AH B AO IY W AA Z DH EH R W EH N DH AH S AH N R OW Z _"},
      {"SEN_a_rod_is_used_to_catch_pink_salmon", "_ AH R AA D IH Z Y UW Z D T UW K AE CH P IH NG K S AE M AH N _"},
      {"SEN_four_hours_of_steady_work_faced_us", "_ F AO R AW R Z AH V S T EH D IY W ER K F EY S T AH S _"},
      {"SEN_the_hogs_were_fed_chopped_corn", "_ DH AH HH AA G Z W ER F EH D CH AA P T K AO R N _"},
      {"SEN_glue_the_sheet_to_the_dark_blue_background",
       "_ G L UW DH AH SH IY T T UW DH AH D AA R K B L UW B AE K G R AW N D _"},
  };
  return sentences;
}

double SentenceDuration(const Sentence& sentence) {
  return kSecondsPerPhoneme * static_cast<double>(VisemesOf(sentence).size());
}

std::array<float, kExpressionCount> SpeechWeights(const Sentence& sentence, double time_s) {
  const std::vector<const Viseme*> visemes = VisemesOf(sentence);
  std::array<double, kExpressionCount> sum = {};
  double total = 0;
  for (size_t i = 0; i < visemes.size(); ++i) {
    const double away = std::abs(time_s - (static_cast<double>(i) + 0.5) * kSecondsPerPhoneme) / kSecondsPerPhoneme;
    const double dominance = visemes[i]->dominance * std::exp(-1.8 * away);
    total += dominance;
    for (const auto& [name, weight] : visemes[i]->weights) {
      if (HasSides(name)) {
        for (const char* side : {"Left", "Right"}) {
          sum[static_cast<size_t>(ExpressionIndex(name + side))] += dominance * weight;
        }
      } else {
        sum[static_cast<size_t>(ExpressionIndex(name))] += dominance * weight;
      }
    }
  }
  std::array<float, kExpressionCount> weights = {};
  for (size_t i = 0; i < weights.size(); ++i) weights[i] = static_cast<float>(std::clamp(sum[i] / total, 0.0, 1.0));
  return weights;
}

}  // namespace likeness
