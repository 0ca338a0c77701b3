#include "likeness/train/bias_activation.h"

#include <ATen/Parallel.h>
#include <torch/csrc/autograd/custom_function.h>

namespace likeness {

namespace {

constexpr int64_t kGrain = 1 << 14;  // values that are worth a thread

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
    at::parallel_for(0, values, kGrain, [&](int64_t begin, int64_t end) {
      for (int64_t n = 0; n < samples; ++n) {
        float* const row = y + n * values;
        for (int64_t i = begin; i < end; ++i) {
          const float a = row[i] + b[i];
          row[i] = a > 0 ? a : factor * a;
        }
      }
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
    at::parallel_for(0, values, kGrain, [&](int64_t begin, int64_t end) {
      for (int64_t n = 0; n < samples; ++n) {
        const int64_t row = n * values;
        for (int64_t i = begin; i < end; ++i) {
          const float d = out[row + i] > 0 ? from[row + i] : factor * from[row + i];
          to[row + i] = d;
          sum[i] += d;
        }
      }
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
