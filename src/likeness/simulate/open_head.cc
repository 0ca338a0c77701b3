#include "likeness/simulate/open_head.h"

#include <charconv>
#include <cstdlib>
#include <system_error>
#include <vector>

#include "likeness/base/error.h"
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

}  // namespace

OpenedHead OpenHead(const std::string& spec, const std::filesystem::path& head_data) {
  (void)head_data;
  const size_t colon = spec.find(':');
  const std::string kind = spec.substr(0, colon);
  const std::string detail = colon == std::string::npos ? "" : spec.substr(colon + 1);
  if (kind == "procedural" || kind == "plain") {
    ProceduralOptions options;
    options.plain = kind == "plain";
    options.seed = detail.empty() ? 0 : ReadSeed(spec, detail);
    return {MakeProceduralHead(options), ""};
  }
  throw Error("there is no head '{}', expected human:SEED, human:FILE.toml, procedural or plain", spec);
}

}  // namespace likeness
