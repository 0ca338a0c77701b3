#include "likeness/avatar/conditions.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/error.h"
#include "likeness/base/text.h"

namespace likeness {

FrameConditions ConditionsOf(const FrameCode& code) { return {code.identity, code.conditions}; }

std::vector<float> ConditionVector(const Avatar& avatar, const FrameConditions& conditions) {
  const Architecture& a = avatar.architecture;
  if (conditions.identity < 0 || conditions.identity >= a.identities) {
    throw Error("there is no person {}; the avatar has {}", conditions.identity, a.identities);
  }
  std::vector<float> c(static_cast<size_t>(IdentityChannels(a)));
  if (a.identity == IdentityConditioning::kOneHot) c[conditions.identity] = 1;
  if (a.identity == IdentityConditioning::kLearned) {
    const std::vector<float>& vectors = avatar.weights.at(kIdentityVectors).values;
    std::copy_n(vectors.begin() + static_cast<ptrdiff_t>(conditions.identity) * a.identity_size, a.identity_size,
                c.begin());
  }
  const std::vector<float>& mean = avatar.condition_mean;
  const std::vector<float>& values = conditions.values.empty() ? mean : conditions.values;
  if (values.size() != mean.size()) {
    throw Error("there are {} values of named conditions; this avatar has {}", values.size(), mean.size());
  }
  for (size_t i = 0; i < mean.size(); ++i) c.push_back((values[i] - mean[i]) / avatar.condition_deviation[i]);
  return c;
}

int FindIdentity(const Avatar& avatar, const std::string& name) {
  std::vector<std::string> names;
  for (const Identity& identity : avatar.identities) {
    if (identity.name == name) return static_cast<int>(names.size());
    names.push_back(identity.name);
  }
  const std::string nearest = NearestWord(name, names);
  throw Error("the avatar shows nobody called '{}'{}; it shows {}", name,
              nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest), fmt::join(names, ", "));
}

void SetCondition(const Avatar& avatar, const std::string& assignment, FrameConditions* conditions) {
  const size_t equals = std::min(assignment.find('='), assignment.size());
  const std::string name = assignment.substr(0, equals);
  if (conditions->values.empty()) conditions->values = avatar.condition_mean;
  size_t at = 0;
  std::vector<std::string> names;
  for (const NamedCondition& condition : avatar.architecture.conditions) {
    const auto size = static_cast<size_t>(condition.size);
    if (condition.name == name) {
      const std::string text = assignment.substr(std::min(equals + 1, assignment.size()));
      TextLines lines("the condition " + name, text);
      lines.Next();
      const std::vector<std::string_view> fields = lines.Fields(',');
      if (fields.size() != size) {
        throw Error("the condition '{}' has {} values, not '{}'; write {}=V1,V2,...", name, size, text, name);
      }
      for (size_t i = 0; i < size; ++i) conditions->values[at + i] = lines.Float(Trim(fields[i]));
      return;
    }
    at += size;
    names.push_back(condition.name);
  }
  const std::string nearest = NearestWord(name, names);
  throw Error("the avatar knows no condition '{}'{}; it has {}", name,
              nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest),
              names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")));
}

}  // namespace likeness
