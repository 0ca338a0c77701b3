#include "likeness/train/ops/normalised_linear.h"

#include <torch/csrc/autograd/custom_function.h>

namespace likeness {

namespace {

class Linear : public torch::autograd::Function<Linear> {
 public:
  static torch::Tensor forward(torch::autograd::AutogradContext* context, const torch::Tensor& x,
                               const torch::Tensor& direction, const torch::Tensor& gain, bool whole,
                               const torch::Tensor& bias) {
    const torch::Tensor norm = whole ? at::linalg_vector_norm(direction).expand_as(gain)
                                     : at::linalg_vector_norm(direction, 2, torch::IntArrayRef{1});
    const torch::Tensor product = at::mm(x, direction.t());
    context->save_for_backward({x, direction, gain, norm, product});
    context->saved_data["whole"] = whole;
    return at::addcmul(bias, product, gain / norm);
  }

  static torch::autograd::tensor_list backward(torch::autograd::AutogradContext* context,
                                               torch::autograd::tensor_list gradients) {
    const auto saved = context->get_saved_variables();
    const torch::Tensor &x = saved[0], &direction = saved[1], &gain = saved[2], &norm = saved[3], &product = saved[4];
    const torch::Tensor &dy = gradients[0], q = (dy * product).sum(0), scaled = dy * (gain / norm);
    torch::Tensor shrink = gain * q / norm.pow(3);
    if (context->saved_data["whole"].toBool()) shrink = shrink.sum().expand_as(gain);
    torch::Tensor ddirection = direction * -shrink.unsqueeze(1);
    ddirection.addmm_(scaled.t(), x);
    torch::Tensor dx;
    if (context->needs_input_grad(0)) dx = at::mm(scaled, direction);
    return {dx, ddirection, q / norm, torch::Tensor(), dy.sum(0)};
  }
};

}  // namespace

torch::Tensor NormalisedLinear(const torch::Tensor& x, const torch::Tensor& direction, const torch::Tensor& gain,
                               bool whole, const torch::Tensor& bias) {
  return Linear::apply(x, direction, gain, whole, bias);
}

}  // namespace likeness
