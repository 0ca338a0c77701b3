// Small networks of every kind that the run time decodes, for tests of all its decoders.

#pragma once

#include <fmt/format.h>

#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "likeness/avatar/architecture.h"

namespace likeness {

struct Choice {
  std::string name;
  Architecture architecture;
};
inline void PrintTo(const Choice& choice, std::ostream* out) { *out << choice.name; }

inline Choice Choose(const std::string& name, const std::function<void(Architecture&)>& change) {
  Choice choice{name, {}};
  choice.architecture.texture_size = 64;
  choice.architecture.vertex_count = 37;
  choice.architecture.latent = 11;
  change(choice.architecture);
  return choice;
}

// Each thing that decides what the decoder computes; normalisation is folded before a file is written.
inline std::vector<Choice> Choices() {
  std::vector<Choice> choices;
  for (const std::string& name : ConditioningNames()) {
    choices.push_back(Choose(name, [&](Architecture& a) { a.conditioning = ParseConditioning(name); }));
  }
  choices.push_back(Choose("tied", [](Architecture& a) { a.untied_bias = UntiedBias::kNone; }));
  choices.push_back(Choose("nearest", [](Architecture& a) { a.upsampling = Upsampling::kNearest; }));
  choices.push_back(Choose("residual", [](Architecture& a) { a.residual = true; }));
  choices.push_back(Choose("residual nearest tied", [](Architecture& a) {
    a.residual = true;
    a.upsampling = Upsampling::kNearest;
    a.untied_bias = UntiedBias::kNone;
    a.conditioning = Conditioning::kFc8All;
  }));
  for (const int size : {16, 32, 128}) {
    choices.push_back(Choose(fmt::format("size {}", size), [&](Architecture& a) { a.texture_size = size; }));
  }
  choices.push_back(Choose("multiface", [](Architecture& a) {
    a.layout = Layout::kMultiface;
    a.texture_size = 256;
    a.latent = 20;
  }));
  choices.push_back(Choose("multiface fc8-all", [](Architecture& a) {
    a.layout = Layout::kMultiface;
    a.texture_size = 256;
    a.latent = 40;
    a.conditioning = Conditioning::kFc8All;
  }));
  choices.push_back(Choose("linear", [](Architecture& a) { a.model = ModelKind::kLinear; }));
  choices.push_back(Choose("people", [](Architecture& a) {
    a.identities = 3;
    a.identity = IdentityConditioning::kOneHot;
  }));
  choices.push_back(Choose("learned people with a condition", [](Architecture& a) {
    a.identities = 2;
    a.identity = IdentityConditioning::kLearned;
    a.identity_size = 5;
    a.conditions = {{"gaze", 6}};
  }));
  choices.push_back(Choose("linear people", [](Architecture& a) {
    a.model = ModelKind::kLinear;
    a.identities = 2;
    a.identity = IdentityConditioning::kOneHot;
  }));
  choices.push_back(Choose("bilinear", [](Architecture& a) { a.model = ModelKind::kBilinear; }));
  return choices;
}

}  // namespace likeness
