#include "likeness/train/ops/masked_loss.h"

#include <ATen/Parallel.h>
#include <torch/csrc/autograd/custom_function.h>

#include <vector>

namespace likeness {

namespace {

constexpr int64_t kBlock = 4096;  // texels that a thread takes at a time

// Writes gradient = factor weight^2 (prediction - target); returns the sum of the squares. Of three channels.
double Texels(const float* __restrict prediction, const float* __restrict target, const float* __restrict weight,
              int64_t texels, float factor, float* __restrict gradient) {
  float sums[16] = {};
  for (int64_t t = 0; t < texels; ++t) {
    const float w = weight[t] * weight[t];
    for (int64_t i = 3 * t; i < 3 * t + 3; ++i) {
      const float difference = prediction[i] - target[i];
      gradient[i] = factor * w * difference;
      sums[t & 15] += w * difference * difference;
    }
  }
  double total = 0;
  for (const float sum : sums) total += sum;
  return total;
}

class Loss : public torch::autograd::Function<Loss> {
 public:
  static torch::Tensor forward(torch::autograd::AutogradContext* context, const torch::Tensor& prediction,
                               const torch::Tensor& target, const torch::Tensor& weight) {
    const int64_t texels = weight.numel(), blocks = (texels + kBlock - 1) / kBlock;
    const auto count = static_cast<double>(prediction.numel());
    const torch::Tensor gradient = torch::empty_like(prediction);
    const float* const p = prediction.const_data_ptr<float>();
    const float* const t = target.const_data_ptr<float>();
    const float* const w = weight.const_data_ptr<float>();
    float* const g = gradient.mutable_data_ptr<float>();
    const auto factor = static_cast<float>(2 / count);
    std::vector<double> sums(blocks);
    at::parallel_for(0, blocks, 1, [&](int64_t first, int64_t last) {
      for (int64_t block = first; block < last; ++block) {
        const int64_t begin = block * kBlock, end = std::min(texels, begin + kBlock);
        sums[block] = Texels(p + 3 * begin, t + 3 * begin, w + begin, end - begin, factor, g + 3 * begin);
      }
    });
    double total = 0;
    for (const double sum : sums) total += sum;
    context->save_for_backward({gradient});
    return torch::full({}, total / count, prediction.options());
  }

  static torch::autograd::tensor_list backward(torch::autograd::AutogradContext* context,
                                               torch::autograd::tensor_list gradients) {
    const torch::Tensor gradient = context->get_saved_variables()[0];
    const torch::NoGradGuard no_grad;
    const auto factor = gradients[0].item<float>();
    const torch::Tensor dprediction = factor == 1 ? gradient : gradient * factor;
    return {dprediction, torch::Tensor(), torch::Tensor()};
  }
};

bool InRows(const torch::Tensor& tensor) {
  return tensor.is_cpu() && tensor.scalar_type() == torch::kFloat32 &&
         tensor.is_contiguous(torch::MemoryFormat::ChannelsLast);
}

}  // namespace

torch::Tensor MaskedSquaredError(const torch::Tensor& prediction, const torch::Tensor& target,
                                 const torch::Tensor& weight) {
  if (prediction.dim() == 4 && prediction.size(1) == 3 && InRows(prediction) && InRows(target) && weight.size(1) == 1 &&
      weight.is_contiguous() && weight.scalar_type() == torch::kFloat32 && prediction.sizes() == target.sizes() &&
      weight.numel() * 3 == prediction.numel()) {
    return Loss::apply(prediction, target, weight);
  }
  return ((prediction - target) * weight).square().mean();
}

}  // namespace likeness
