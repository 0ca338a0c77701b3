// Quantiles of measurements.

#pragma once

#include <vector>

namespace likeness {

// The value below which a share `q`, 0 ... 1, of the values lie; one of them. There is at least one.
double Quantile(std::vector<double> values, double q);

}  // namespace likeness
