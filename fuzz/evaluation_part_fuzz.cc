#include "fuzz.h"
#include "likeness/train/evaluation_part_file.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  CheckRoundTrip(
      bytes, [](std::string_view text) { return ParsePart(kPath, text, 3); }, PartText);
}

}  // namespace likeness
