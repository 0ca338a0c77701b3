#include "fuzz.h"
#include "likeness/capture/condition_file.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  CheckRoundTrip(
      bytes, [](std::string_view text) { return ParseConditionTable(kPath, text); }, ConditionTableText);
}

}  // namespace likeness
