#include "likeness/avatar/architecture.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <nlohmann/json.hpp>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/json.h"

namespace likeness {

namespace {

// The spelling of every value of an enumeration, in its order.
template <typename Enum>
const std::vector<std::string>& Names();

template <>
const std::vector<std::string>& Names<ModelKind>() {
  static const std::vector<std::string> names = {"deep", "linear", "bilinear"};
  return names;
}
template <>
const std::vector<std::string>& Names<Conditioning>() {
  static const std::vector<std::string> names = {"raw", "fc8", "fc32", "raw-all", "fc8-all"};
  return names;
}
template <>
const std::vector<std::string>& Names<Normalisation>() {
  static const std::vector<std::string> names = {"none", "batch", "weight", "weight-tensor"};
  return names;
}
template <>
const std::vector<std::string>& Names<UntiedBias>() {
  static const std::vector<std::string> names = {"none", "decoder", "decoder+channel", "everywhere"};
  return names;
}
template <>
const std::vector<std::string>& Names<Layout>() {
  static const std::vector<std::string> names = {"paper", "multiface"};
  return names;
}
template <>
const std::vector<std::string>& Names<Upsampling>() {
  static const std::vector<std::string> names = {"transposed", "nearest"};
  return names;
}
template <>
const std::vector<std::string>& Names<IdentityConditioning>() {
  static const std::vector<std::string> names = {"none", "one-hot", "learned"};
  return names;
}
template <>
const std::vector<std::string>& Names<Geometry>() {
  static const std::vector<std::string> names = {"tracked", "smoothed", "ellipsoid", "billboard"};
  return names;
}

template <typename Enum>
std::string Spelling(Enum value) {
  return Names<Enum>().at(static_cast<size_t>(value));
}

template <typename Enum>
Enum Parse(const char* what, const std::string& text) {
  const std::vector<std::string>& names = Names<Enum>();
  const auto found = std::find(names.begin(), names.end(), text);
  if (found == names.end()) throw Error("{} is '{}'; known are {}", what, text, fmt::join(names, ", "));
  return static_cast<Enum>(found - names.begin());
}

constexpr int kPaperInnerSize = 4;
constexpr int kMultifaceShrink = 256;  // eight halvings

constexpr int kMostIdentities = 1000;
constexpr size_t kMostConditions = 64;
constexpr int kMostConditionValues = 1024;
constexpr size_t kLongestConditionName = 64;

void InRange(const char* what, int value, int least, int most) {
  if (value < least || value > most) throw Error("{} is {}; expected {} to {}", what, value, least, most);
}

}  // namespace

void Architecture::Check() const {
  InRange("texture size", texture_size, 16, 4096);
  if (!std::has_single_bit(static_cast<unsigned>(texture_size))) {
    throw Error("texture size is {}; expected a power of two (256, 512, 1024, ...)", texture_size);
  }
  InRange("vertex count", vertex_count, 1, 1'000'000);
  InRange("latent size", latent, 1, 4096);
  if (model == ModelKind::kDeep && layout == Layout::kMultiface && texture_size < kMultifaceShrink) {
    throw Error("texture size is {}; Multiface's layout halves it eight times: expected at least {}", texture_size,
                kMultifaceShrink);
  }
  InRange("identities", identities, 1, kMostIdentities);
  if (identity != IdentityConditioning::kNone && identities == 1) {
    throw Error("identity is '{}', which tells several people apart; there is one", ToString(identity));
  }
  const bool learned = identity == IdentityConditioning::kLearned;
  InRange("identity size", identity_size, learned ? 1 : 0, learned ? kMostConditionValues : 0);
  if (conditions.size() > kMostConditions) {
    throw Error("there are {} named conditions; expected at most {}", conditions.size(), kMostConditions);
  }
  std::set<std::string> names;
  for (const NamedCondition& condition : conditions) {
    if (!IsConditionName(condition.name)) {
      throw Error("a condition is called '{}'; expected letters, digits, '-' and '_'", condition.name);
    }
    if (!names.insert(condition.name).second) throw Error("the condition '{}' is named twice", condition.name);
    InRange(("size of " + condition.name).c_str(), condition.size, 1, kMostConditionValues);
  }
}

std::vector<int> EncoderChannels(const Architecture& architecture) {
  if (architecture.layout == Layout::kMultiface) return {16, 16, 32, 32, 64, 64, 128, 128};
  constexpr std::array kPaper = {16, 32, 32, 64, 64, 128, 128, 256};
  std::vector<int> channels;
  for (int size = architecture.texture_size; size > kPaperInnerSize; size /= 2) {
    channels.push_back(kPaper[std::min(channels.size(), kPaper.size() - 1)]);
  }
  return channels;
}

std::vector<int> DecoderChannels(const Architecture& architecture) {
  const int latent = architecture.latent;
  if (architecture.layout == Layout::kMultiface) return {latent, latent, 64, 64, 32, 32, 16, 16, 3};
  std::vector<int> channels = EncoderChannels(architecture);
  std::reverse(channels.begin(), channels.end());
  channels.push_back(3);
  return channels;
}

int InnerSize(const Architecture& architecture) {
  return architecture.layout == Layout::kMultiface ? architecture.texture_size / kMultifaceShrink : kPaperInnerSize;
}

EncoderScales ScalesOf(const Architecture& architecture) {
  return architecture.layout == Layout::kMultiface ? EncoderScales{0.1, 0.01} : EncoderScales();
}

bool ViewInAllLayers(const Architecture& architecture) {
  return architecture.conditioning == Conditioning::kRawAll || architecture.conditioning == Conditioning::kFc8All;
}

int ViewChannels(const Architecture& architecture) {
  switch (architecture.conditioning) {
    case Conditioning::kFc8:
    case Conditioning::kFc8All:
      return 8;
    case Conditioning::kFc32:
      return 32;
    case Conditioning::kRaw:
    case Conditioning::kRawAll:
      break;
  }
  return 3;
}

int IdentityChannels(const Architecture& architecture) {
  switch (architecture.identity) {
    case IdentityConditioning::kOneHot:
      return architecture.identities;
    case IdentityConditioning::kLearned:
      return architecture.identity_size;
    case IdentityConditioning::kNone:
      break;
  }
  return 0;
}

int NamedChannels(const Architecture& architecture) {
  int channels = 0;
  for (const NamedCondition& condition : architecture.conditions) channels += condition.size;
  return channels;
}

int ConditionChannels(const Architecture& architecture) {
  return IdentityChannels(architecture) + NamedChannels(architecture);
}

bool IsConditionName(const std::string& name) {
  const auto known = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  };
  return !name.empty() && name.size() <= kLongestConditionName && std::all_of(name.begin(), name.end(), known);
}

std::string ToString(ModelKind value) { return Spelling(value); }
std::string ToString(Conditioning value) { return Spelling(value); }
std::string ToString(Normalisation value) { return Spelling(value); }
std::string ToString(UntiedBias value) { return Spelling(value); }
std::string ToString(Layout value) { return Spelling(value); }
std::string ToString(Upsampling value) { return Spelling(value); }
std::string ToString(IdentityConditioning value) { return Spelling(value); }
std::string ToString(Geometry value) { return Spelling(value); }
ModelKind ParseModelKind(const std::string& text) { return Parse<ModelKind>("model", text); }
Conditioning ParseConditioning(const std::string& text) { return Parse<Conditioning>("conditioning", text); }
Normalisation ParseNormalisation(const std::string& text) { return Parse<Normalisation>("normalisation", text); }
UntiedBias ParseUntiedBias(const std::string& text) { return Parse<UntiedBias>("untied bias", text); }
Layout ParseLayout(const std::string& text) { return Parse<Layout>("layout", text); }
Upsampling ParseUpsampling(const std::string& text) { return Parse<Upsampling>("upsampling", text); }
IdentityConditioning ParseIdentityConditioning(const std::string& text) {
  return Parse<IdentityConditioning>("identity", text);
}
Geometry ParseGeometry(const std::string& text) { return Parse<Geometry>("geometry", text); }
const std::vector<std::string>& ModelKindNames() { return Names<ModelKind>(); }
const std::vector<std::string>& ConditioningNames() { return Names<Conditioning>(); }
const std::vector<std::string>& NormalisationNames() { return Names<Normalisation>(); }
const std::vector<std::string>& UntiedBiasNames() { return Names<UntiedBias>(); }
const std::vector<std::string>& LayoutNames() { return Names<Layout>(); }
const std::vector<std::string>& UpsamplingNames() { return Names<Upsampling>(); }
const std::vector<std::string>& IdentityConditioningNames() { return Names<IdentityConditioning>(); }
const std::vector<std::string>& GeometryNames() { return Names<Geometry>(); }

std::string ArchitectureToJson(const Architecture& a) {
  nlohmann::ordered_json conditions = nlohmann::ordered_json::array();
  for (const NamedCondition& condition : a.conditions) conditions.push_back({condition.name, condition.size});
  const nlohmann::ordered_json json = {{"preset", a.preset},
                                       {"model", ToString(a.model)},
                                       {"texture_size", a.texture_size},
                                       {"vertex_count", a.vertex_count},
                                       {"latent", a.latent},
                                       {"conditioning", ToString(a.conditioning)},
                                       {"normalisation", ToString(a.normalisation)},
                                       {"untied_bias", ToString(a.untied_bias)},
                                       {"layout", ToString(a.layout)},
                                       {"upsampling", ToString(a.upsampling)},
                                       {"residual", a.residual},
                                       {"geometry", ToString(a.geometry)},
                                       {"identities", a.identities},
                                       {"identity", ToString(a.identity)},
                                       {"identity_size", a.identity_size},
                                       {"conditions", conditions}};
  return json.dump();
}

Architecture ArchitectureFromJson(const std::string& text) {
  Architecture a;
  try {
    const nlohmann::json json = ParseJson("the architecture", text);
    const auto whole = [](const char* what, const nlohmann::json& value) {
      if (!value.is_number_integer() || value < 0 || value > 1'000'000) {
        throw Error("the architecture's {} is {}; expected a whole number", what, value.dump());
      }
      return value.get<int>();
    };
    const auto integer = [&](const char* key) { return whole(key, json.at(key)); };
    const auto word = [&](const char* key) { return json.at(key).get<std::string>(); };
    a.preset = word("preset");
    a.model = ParseModelKind(word("model"));
    a.texture_size = integer("texture_size");
    a.vertex_count = integer("vertex_count");
    a.latent = integer("latent");
    a.conditioning = ParseConditioning(word("conditioning"));
    a.normalisation = ParseNormalisation(word("normalisation"));
    a.untied_bias = ParseUntiedBias(word("untied_bias"));
    // Files of version 1 do not name these.
    a.layout = ParseLayout(json.value("layout", ToString(a.layout)));
    a.upsampling = ParseUpsampling(json.value("upsampling", ToString(a.upsampling)));
    a.residual = json.value("residual", a.residual);
    a.geometry = ParseGeometry(word("geometry"));
    a.identities = integer("identities");
    // Files of version 2 do not name these.
    a.identity = ParseIdentityConditioning(json.value("identity", ToString(a.identity)));
    if (json.contains("identity_size")) a.identity_size = integer("identity_size");
    for (const nlohmann::json& condition : json.value("conditions", nlohmann::json::array())) {
      a.conditions.push_back({condition.at(0).get<std::string>(), whole("conditions' size", condition.at(1))});
    }
  } catch (const nlohmann::json::exception& error) {
    throw Error("the architecture is not understood: {}", error.what());
  }
  return a;
}

}  // namespace likeness
