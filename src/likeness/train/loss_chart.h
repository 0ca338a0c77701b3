// The loss curve as an SVG drawing for a web page.

#pragma once

#include <string>
#include <vector>

#include "likeness/train/run_record.h"

namespace likeness {

// An <svg> element: the total and its terms over iterations, on a logarithmic scale, each labelled at its end. Colours
// come from the page's style sheet: classes `chart`, `grid`, `tick`, and `line-0` ... `line-4`. Empty when the log has
// fewer than two rows.
std::string LossChart(const LossLog& log);

// At most `most` points: means over equal runs of the values.
std::vector<double> Thinned(const std::vector<double>& values, size_t most);

}  // namespace likeness
