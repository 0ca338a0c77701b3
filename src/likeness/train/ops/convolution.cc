#include "likeness/train/ops/convolution.h"

#include <torch/csrc/autograd/custom_function.h>

#include "likeness/base/error.h"
#include "likeness/train/bias_activation.h"
#include "likeness/train/ops/precision.h"
#include "likeness/train/ops/texture_layer.h"

namespace likeness {

namespace {

constexpr auto kChannelsLast = torch::MemoryFormat::ChannelsLast;

// Small texels a side from which rows fill vectors and tiles well enough.
constexpr int64_t kLeastSide = 16;

RowValues ValuesOf(const torch::Tensor& tensor) {
  return {tensor.const_data_ptr(), tensor.scalar_type() == torch::kBFloat16};
}

torch::Tensor InRows(const torch::Tensor& tensor) {
  const bool fits = tensor.scalar_type() == torch::kFloat32 || tensor.scalar_type() == torch::kBFloat16;
  return (fits ? tensor : tensor.to(torch::kFloat32)).contiguous(kChannelsLast);
}

// An untied bias [C, H, W] with channels interleaved; a tied one as it is.
torch::Tensor BiasInRows(const torch::Tensor& bias) {
  return bias.dim() == 3 ? bias.unsqueeze(0).contiguous(kChannelsLast).squeeze(0) : bias.contiguous();
}

// weight has the small image's channels first in either kind.
TextureLayer LayerOf(const RowKernels& kernels, ConvolutionKind kind, const torch::Tensor& x,
                     const torch::Tensor& weight) {
  const int64_t ratio = kind == ConvolutionKind::kDown ? 2 : 1;
  return {kernels,
          static_cast<int>(x.size(0)),
          static_cast<int>(x.size(2) / ratio),
          static_cast<int>(x.size(3) / ratio),
          static_cast<int>(weight.size(1)),
          static_cast<int>(weight.size(0))};
}

class Convolution : public torch::autograd::Function<Convolution> {
 public:
  static torch::Tensor forward(torch::autograd::AutogradContext* context, const torch::Tensor& x_any,
                               const torch::Tensor& weight_any, const torch::Tensor& bias_any, double slope, bool up,
                               int64_t kernels_address, bool bf16) {
    const auto kind = up ? ConvolutionKind::kUp : ConvolutionKind::kDown;
    const torch::Tensor x = InRows(x_any), weight = weight_any.contiguous(), bias = BiasInRows(bias_any);
    const TextureLayer layer = LayerOf(*reinterpret_cast<const RowKernels*>(kernels_address), kind, x, weight);
    const int64_t scale = up ? 2 : 1;
    const torch::Tensor y =
        torch::empty({x.size(0), up ? layer.large : layer.small, scale * layer.height, scale * layer.width},
                     x.options().dtype(bf16 ? torch::kBFloat16 : torch::kFloat32).memory_format(kChannelsLast));
    const float* const w = weight.const_data_ptr<float>();
    const float* const b = bias.const_data_ptr<float>();
    const bool untied = bias.dim() == 3;
    if (up) {
      layer.Up(ValuesOf(x), w, b, untied, static_cast<float>(slope), y.mutable_data_ptr(), bf16);
    } else {
      layer.Down(ValuesOf(x), w, b, untied, static_cast<float>(slope), y.mutable_data_ptr(), bf16);
    }
    context->save_for_backward({x, weight, bias, y});
    context->saved_data["slope"] = slope;
    context->saved_data["up"] = up;
    context->saved_data["kernels"] = kernels_address;
    return y;
  }

  static torch::autograd::tensor_list backward(torch::autograd::AutogradContext* context,
                                               torch::autograd::tensor_list gradients) {
    const auto saved = context->get_saved_variables();
    const torch::Tensor &x = saved[0], &weight = saved[1], &bias = saved[2], &y = saved[3];
    const bool up = context->saved_data["up"].toBool();
    const auto kind = up ? ConvolutionKind::kUp : ConvolutionKind::kDown;
    const auto slope = static_cast<float>(context->saved_data["slope"].toDouble());
    const auto* kernels = reinterpret_cast<const RowKernels*>(context->saved_data["kernels"].toInt());
    const TextureLayer layer = LayerOf(*kernels, kind, x, weight);
    const torch::Tensor dy = InRows(gradients[0]), dweight = torch::empty_like(weight), dbias = torch::empty_like(bias);
    torch::Tensor dx;
    TextureLayer::Gradients to;
    if (context->needs_input_grad(0)) {
      dx = torch::empty_like(x);
      to.x = dx.mutable_data_ptr();
      to.x_bf16 = dx.scalar_type() == torch::kBFloat16;
    }
    to.weight = dweight.mutable_data_ptr<float>();
    to.bias = dbias.mutable_data_ptr<float>();
    const float* const w = weight.const_data_ptr<float>();
    if (up) {
      layer.UpBackward(ValuesOf(x), ValuesOf(y), ValuesOf(dy), w, bias.dim() == 3, slope, to);
    } else {
      layer.DownBackward(ValuesOf(x), ValuesOf(y), ValuesOf(dy), w, bias.dim() == 3, slope, to);
    }
    const torch::Tensor none;
    return {dx, dweight, dbias, none, none, none, none};
  }
};

bool Fits(ConvolutionKind kind, const torch::Tensor& x, const torch::Tensor& weight, const torch::Tensor& bias) {
  const int64_t ratio = kind == ConvolutionKind::kDown ? 2 : 1;
  return x.is_cpu() && (x.scalar_type() == torch::kFloat32 || x.scalar_type() == torch::kBFloat16) &&
         weight.scalar_type() == torch::kFloat32 && bias.scalar_type() == torch::kFloat32 && weight.size(0) % 16 == 0 &&
         x.size(2) % ratio == 0 && x.size(3) % ratio == 0 && x.size(3) >= kLeastSide * ratio;
}

}  // namespace

torch::Tensor ConvolveWith(const RowKernels& kernels, ConvolutionKind kind, const torch::Tensor& x,
                           const torch::Tensor& weight, const torch::Tensor& bias, double slope) {
  LIKENESS_CHECK(weight.dim() == 4 && weight.size(0) % 16 == 0);
  const bool bf16 = kernels.element_bytes == 2 && slope != 1;
  return Convolution::apply(x, weight, bias, slope, kind == ConvolutionKind::kUp, reinterpret_cast<int64_t>(&kernels),
                            bf16);
}

torch::Tensor ConvolvePlainly(ConvolutionKind kind, const torch::Tensor& any, const torch::Tensor& weight,
                              const torch::Tensor& bias, double slope) {
  const bool untied = bias.dim() == 3;
  const torch::Tensor x = any.to(weight.scalar_type()), tied = untied ? torch::Tensor() : bias;
  const torch::Tensor y = kind == ConvolutionKind::kUp ? torch::conv_transpose2d(x, weight, tied, 2, 1)
                                                       : torch::conv2d(x, weight, tied, 2, 1);
  if (untied) return AddBiasAndActivate(y, bias, slope);
  return slope == 1 ? y : torch::leaky_relu(y, slope);
}

torch::Tensor ConvolveAndActivate(ConvolutionKind kind, const torch::Tensor& x, const torch::Tensor& weight,
                                  const torch::Tensor& bias, double slope) {
  if (!Fits(kind, x, weight, bias)) return ConvolvePlainly(kind, x, weight, bias, slope);
  const RowKernels* half = CurrentPrecision() == Precision::kBfloat16 ? Bfloat16RowKernels() : nullptr;
  return ConvolveWith(half != nullptr ? *half : FloatRowKernels(), kind, x, weight, bias, slope);
}

}  // namespace likeness
