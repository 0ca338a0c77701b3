// Files of bare numbers: a variance, a latent code.

#include <cmath>

#include "fuzz.h"
#include "likeness/avatar/codes.h"
#include "likeness/texture/texture_set.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  if (const auto variance = Parsed([&] { return ParseVariance(kPath, bytes); })) {
    LIKENESS_CHECK(*variance > 0 && std::isfinite(*variance));
  }
  constexpr int kLatent = 4;
  if (const auto code = Parsed([&] { return ParseCode(kPath, std::string(bytes), kLatent); })) {
    LIKENESS_CHECK(code->size() == kLatent);
    for (const float value : *code) LIKENESS_CHECK(std::isfinite(value));
  }
}

}  // namespace likeness
