#include "fuzz.h"
#include "likeness/texture/texture_sums.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  CheckRoundTrip(
      bytes, [](std::string_view text) { return TextureSums::Parse(kPath, text, 2); },
      [](const TextureSums& sums) {
        sums.Average();
        sums.Variance();
        return sums.Bytes();
      });
}

}  // namespace likeness
