#include "fuzz.h"
#include "likeness/capture/coefficient_table.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  const std::vector<std::string> names = {"a", "b"};
  const auto table = Parsed([&] { return ParseCoefficientTable(kPath, bytes, names); });
  if (!table) return;
  for (const auto& [frame, values] : *table) {
    LIKENESS_CHECK(values.size() == names.size());
    for (const float value : values) LIKENESS_CHECK(value >= 0 && value <= 1);
  }
}

}  // namespace likeness
