#include "likeness/base/quantile.h"

#include <algorithm>

#include "likeness/base/error.h"

namespace likeness {

double Quantile(std::vector<double> values, double q) {
  LIKENESS_CHECK(!values.empty() && q >= 0 && q <= 1);
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<size_t>(q * static_cast<double>(values.size())))];
}

}  // namespace likeness
