#include <algorithm>

#include "fuzz.h"
#include "likeness/base/npy.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  const auto array = Parsed([&] { return ParseNpy(kPath, bytes); });
  if (!array) return;
  size_t count = 1;
  for (const int64_t extent : array->shape) count *= static_cast<size_t>(extent);
  LIKENESS_CHECK(array->values.size() == count);
  std::vector<float> values(count);
  std::transform(array->values.begin(), array->values.end(), values.begin(),
                 [](double value) { return static_cast<float>(value); });
  LIKENESS_CHECK(ParseNpy(kPath, EncodeNpy(array->shape, values)).shape == array->shape);
}

}  // namespace likeness
