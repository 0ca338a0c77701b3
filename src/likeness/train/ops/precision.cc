#include "likeness/train/ops/precision.h"

#include <fmt/ranges.h>

#include "likeness/base/error.h"

namespace likeness {

namespace {
thread_local Precision t_precision = Precision::kFloat32;
}  // namespace

const std::vector<std::string>& PrecisionNames() {
  static const std::vector<std::string> names = {"auto", "float32", "bfloat16"};
  return names;
}

Precision PrecisionFrom(const std::string& name) {
  if (name == "float32") return Precision::kFloat32;
  if (name == "bfloat16" || name == "auto") return Precision::kBfloat16;
  throw Error("precision is '{}'; known are {}", name, fmt::join(PrecisionNames(), ", "));
}

Precision CurrentPrecision() { return t_precision; }

PrecisionScope::PrecisionScope(Precision precision) : outer_(t_precision) { t_precision = precision; }

PrecisionScope::~PrecisionScope() { t_precision = outer_; }

}  // namespace likeness
