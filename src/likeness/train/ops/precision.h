// Which number format the convolutions work in, chosen for a scope as LibTorch's NoGradGuard is.

#pragma once

#include <string>
#include <vector>

namespace likeness {

enum class Precision {
  kFloat32,
  // Operands, features and their gradients in bfloat16; sums, biases and weights as the optimiser has them in float32.
  // Only where the processor multiplies such matrices in hardware; elsewhere the same as kFloat32.
  kBfloat16,
};

// "float32", "bfloat16", or "auto": bfloat16 where it is fast.
const std::vector<std::string>& PrecisionNames();
// Throws Error naming what is known.
Precision PrecisionFrom(const std::string& name);

Precision CurrentPrecision();

class PrecisionScope {
 public:
  explicit PrecisionScope(Precision precision);
  ~PrecisionScope();
  PrecisionScope(const PrecisionScope&) = delete;
  PrecisionScope& operator=(const PrecisionScope&) = delete;

 private:
  const Precision outer_;
};

}  // namespace likeness
