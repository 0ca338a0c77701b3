#include <cmath>

#include "fuzz.h"
#include "likeness/simulate/glb/shape_names.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  const auto map = Parsed([&] { return ParseShapeMap(kPath, bytes); });
  if (!map) return;
  const std::vector<std::string> names = {"h_expressions.MouthOpen_h", "jawOpen", "ARKit_eyeBlink_L", ""};
  for (const auto& terms : MatchShapes(names, *map)) {
    for (const ShapeTerm& term : terms) {
      LIKENESS_CHECK(term.target >= 0 && term.target < static_cast<int>(names.size()) && std::isfinite(term.weight));
    }
  }
}

}  // namespace likeness
