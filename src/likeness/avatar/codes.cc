#include "likeness/avatar/codes.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/text.h"

namespace likeness {

std::vector<float> MeanCode(const Avatar& avatar, int identity) {
  std::vector<double> sum(avatar.architecture.latent, 0.0);
  double count = 0;
  for (const FrameCode& code : avatar.codes) {
    if (code.identity != identity) continue;
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += code.mu[i];
    ++count;
  }
  std::vector<float> mean(sum.size());
  std::transform(sum.begin(), sum.end(), mean.begin(),
                 [&](double s) { return static_cast<float>(s / std::max(1.0, count)); });
  return mean;
}

NamedCode FindCode(const Avatar& avatar, const std::string& name, int identity) {
  if (name == "mean") return {MeanCode(avatar, identity), nullptr};
  size_t index = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), index);
  if (error == std::errc() && end == name.data() + name.size()) {
    if (index < avatar.codes.size()) return {avatar.codes[index].mu, &avatar.codes[index]};
    throw Error("there is no frame {}: the avatar has the codes of {} frames", name, avatar.codes.size());
  }
  std::vector<std::string> names;
  const FrameCode* anybody = nullptr;
  for (const FrameCode& code : avatar.codes) {
    const std::string short_name = code.segment + "/" + code.frame;
    names.push_back(short_name);
    if (avatar.identities.size() > 1) names.push_back(avatar.identities[code.identity].name + "/" + short_name);
    if (names.back() == name || (short_name == name && code.identity == identity)) return {code.mu, &code};
    if (short_name == name && anybody == nullptr) anybody = &code;
  }
  if (anybody != nullptr) return {anybody->mu, anybody};
  const std::string nearest = NearestWord(name, names);
  throw Error("there is no frame '{}'{}; expected mean, a number below {}, or {}SEGMENT/FRAME of a training frame",
              name, nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest), avatar.codes.size(),
              avatar.identities.size() > 1 ? "PERSON/" : "");
}

std::vector<std::vector<float>> ReadCodeSequence(const std::filesystem::path& path, int latent) {
  constexpr uint64_t kMostBytes = 1 << 28;
  return ParseCodeSequence(path, ReadFile(path, kMostBytes), latent);
}

std::vector<std::vector<float>> ParseCodeSequence(const std::filesystem::path& path_for_errors, std::string text,
                                                  int latent) {
  std::replace(text.begin(), text.end(), ',', ' ');
  TextLines lines(path_for_errors, text);
  std::vector<std::vector<float>> codes;
  size_t count = 0;
  while (lines.Next()) {
    for (const std::string_view word : lines.Words()) {
      if (count++ % latent == 0) codes.emplace_back();
      codes.back().push_back(lines.Float(word));
    }
  }
  if (count == 0 || count % latent != 0) {
    throw FileError(path_for_errors, fmt::format("holds {} numbers; this avatar's codes have {} each", count, latent));
  }
  return codes;
}

std::vector<float> ReadCode(const std::filesystem::path& path, int latent) {
  constexpr uint64_t kMostBytes = 1 << 20;
  return ParseCode(path, ReadFile(path, kMostBytes), latent);
}

std::vector<float> ParseCode(const std::filesystem::path& path_for_errors, std::string text, int latent) {
  std::vector<std::vector<float>> codes = ParseCodeSequence(path_for_errors, std::move(text), latent);
  if (codes.size() != 1) throw FileError(path_for_errors, fmt::format("holds {} codes; expected one", codes.size()));
  return std::move(codes.front());
}

}  // namespace likeness
