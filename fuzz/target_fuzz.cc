// MakeHuman targets, plain and packed.

#include "fuzz.h"
#include "likeness/simulate/human/target.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  constexpr size_t kMostBytes = 1 << 20;
  constexpr int kVertices = 1000;
  const bool packed = bytes.starts_with("\x1f\x8b");
  const auto text = Parsed([&] { return packed ? Gunzip(kPath, bytes, kMostBytes) : std::string(bytes); });
  if (!text) return;
  const auto target = Parsed([&] { return ParseTarget(kPath, *text, kVertices); });
  if (!target) return;
  LIKENESS_CHECK(target->vertices.size() == target->deltas.size());
  for (const int vertex : target->vertices) LIKENESS_CHECK(vertex >= 0 && vertex < kVertices);
  for (const Eigen::Vector3f& delta : target->deltas) LIKENESS_CHECK(delta.allFinite());
}

}  // namespace likeness
