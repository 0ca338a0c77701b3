#include "likeness/train/bias_activation.h"

#include <ATen/Parallel.h>
#include <torch/csrc/autograd/custom_function.h>

#include <algorithm>

namespace likeness {

namespace {

constexpr int64_t kBlock = 4096;  // values of the bias at once: they stay in the nearest cache over all samples

// The loops are free of branches and of overlapping memory so that compilers make vector code of them: signs are
// random, and a branch on each would cost more than the memory.
void Forward(float* __restrict y, const float* __restrict bias, int64_t count, float slope) {
  for (int64_t i = 0; i < count; ++i) {
    const float a = y[i] + bias[i], scaled = slope * a;
    y[i] = a > scaled ? a : scaled;
  }
}

void Backward(const float* __restrict y, const float* __restrict dy, float* __restrict dx, float* __restrict dbias,
              int64_t count, float slope) {
  for (int64_t i = 0; i < count; ++i) {
    const float factor = y[i] > 0 ? 1.0f : slope;
    dx[i] = factor * dy[i];
    dbias[i] += factor * dy[i];
  }
}

// Calls body(n, begin, end) for blocks of values [begin, end), all samples n of a block one after the other.
template <typename Body>
void ForBlocks(int64_t samples, int64_t values, const Body& body) {
  at::parallel_for(0, (values + kBlock - 1) / kBlock, 1, [&](int64_t first, int64_t last) {
    for (int64_t block = first; block < last; ++block) {
      const int64_t begin = block * kBlock, end = std::min(values, begin + kBlock);
      for (int64_t n = 0; n < samples; ++n) body(n, begin, end);
    }
  });
}

// Whether every sample of x lies in memory in the order of the bias.
bool LaidOutAlike(const torch::Tensor& x, const torch::Tensor& bias) {
  return x.is_cpu() && x.scalar_type() == torch::kFloat32 && bias.scalar_type() == torch::kFloat32 && x.dim() == 4 &&
         x.strides().slice(1) == bias.strides() && bias.is_non_overlapping_and_dense() &&
         x.is_non_overlapping_and_dense();
}

class Fused : public torch::autograd::Function<Fused> {
 public:
  static torch::Tensor forward(torch::autograd::AutogradContext* context, const torch::Tensor& x,
                               const torch::Tensor& bias, double slope) {
    const int64_t samples = x.size(0), values = bias.numel();
    const auto factor = static_cast<float>(slope);
    float* const y = x.mutable_data_ptr<float>();
    const float* const b = bias.const_data_ptr<float>();
    ForBlocks(samples, values, [=](int64_t n, int64_t begin, int64_t end) {
      Forward(y + n * values + begin, b + begin, end - begin, factor);
    });
    context->mark_dirty({x});
    context->save_for_backward({x, bias});
    context->saved_data["slope"] = slope;
    return x;
  }

  static torch::autograd::tensor_list backward(torch::autograd::AutogradContext* context,
                                               torch::autograd::tensor_list gradients) {
    const auto saved = context->get_saved_variables();
    const torch::Tensor &y = saved[0], &bias = saved[1];
    const auto factor = static_cast<float>(context->saved_data["slope"].toDouble());
    torch::Tensor dy = gradients[0];
    if (dy.strides() != y.strides()) dy = torch::empty_like(y).copy_(dy);
    const torch::Tensor dx = torch::empty_like(y), dbias = torch::zeros_like(bias);
    const int64_t samples = y.size(0), values = bias.numel();
    const float* const out = y.const_data_ptr<float>();
    const float* const from = dy.const_data_ptr<float>();
    float* const to = dx.mutable_data_ptr<float>();
    float* const sum = dbias.mutable_data_ptr<float>();
    ForBlocks(samples, values, [=](int64_t n, int64_t begin, int64_t end) {
      const int64_t at = n * values + begin;
      Backward(out + at, from + at, to + at, sum + begin, end - begin, factor);
    });
    return {dx, dbias, torch::Tensor()};
  }
};

}  // namespace

torch::Tensor AddBiasAndActivate(const torch::Tensor& x, const torch::Tensor& bias, double slope) {
  if (LaidOutAlike(x, bias)) return Fused::apply(x, bias, slope);
  const torch::Tensor sum = x + bias;
  return slope == 1 ? sum : torch::leaky_relu(sum, slope);
}

}  // namespace likeness
