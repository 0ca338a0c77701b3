// Binaries of float32, as tracked vertices are.

#include <cmath>
#include <cstring>

#include "fuzz.h"
#include "likeness/base/file.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  for (const size_t count : {size_t{0}, size_t{3}, bytes.size() / sizeof(float)}) {
    const auto values = Parsed([&] { return ParseFloats(kPath, bytes, count); });
    if (!values) continue;
    LIKENESS_CHECK(values->size() * sizeof(float) == bytes.size());
    for (const float value : *values) LIKENESS_CHECK(std::isfinite(value));
  }
}

}  // namespace likeness
