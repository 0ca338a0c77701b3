// Peak expressions by name: combinations of the 52 shapes, as an actor is asked for them one after another.

#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "likeness/simulate/head.h"

namespace likeness {

struct PeakExpression {
  std::string name;                                    // "smile_open"
  std::vector<std::pair<std::string, float>> weights;  // "*" at a shape's end stands for both sides
};

// 122 of them, as many as the paper's capture has; no two are alike. The most different ones come first: short
// performances take only those.
const std::vector<PeakExpression>& PeakExpressions();

// Adds `amount` (0 ... 1) of an expression to weights, which stay in 0 ... 1.
void AddExpression(const PeakExpression& expression, float amount, std::array<float, kExpressionCount>* weights);

}  // namespace likeness
