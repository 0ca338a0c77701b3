#include "likeness/avatar/tensor_registry.h"

#include <fmt/format.h>

#include "likeness/base/error.h"

namespace likeness {

std::vector<int64_t> LayerInfo::WeightShape() const {
  switch (kind) {
    case LayerKind::kLinear:
      return {out, in};
    case LayerKind::kConvolution:
      return {out, in, kKernel, kKernel};
    case LayerKind::kTransposedConvolution:
      return {in, out, kKernel, kKernel};
  }
  return {};
}

std::vector<int64_t> LayerInfo::BiasShape() const {
  if (untied_bias) return {out, out_size, out_size};
  return {out};
}

std::vector<LayerInfo> Layers(const Architecture& architecture) {
  LIKENESS_CHECK(architecture.model == ModelKind::kDeep && architecture.vertex_count > 0);
  const std::vector<int> channels = EncoderChannels(architecture);
  const int inner = channels.back() * kInnerSize * kInnerSize;
  const int mesh = 3 * architecture.vertex_count;
  const int view = ViewChannels(architecture);
  const int depth = static_cast<int>(channels.size());
  std::vector<LayerInfo> layers;
  const auto linear = [&](const std::string& name, int in, int out, const std::string& meaning) {
    layers.push_back({name, LayerKind::kLinear, in, out, 1, false, meaning});
  };

  for (int i = 0, in = 3, size = architecture.texture_size / 2; i < depth; in = channels[i], ++i, size /= 2) {
    layers.push_back({fmt::format("encoder.texture_conv.{}", i), LayerKind::kConvolution, in, channels[i], size,
                      architecture.untied_bias == UntiedBias::kEverywhere,
                      "halves the standardised average texture's side"});
  }
  linear("encoder.texture_fc", inner, kSubEncoding, "the inner features, channel by channel and row by row");
  linear("encoder.mesh_fc", mesh, kSubEncoding, "the standardised vertices, x y z after x y z");
  linear("encoder.mu_fc", 2 * kSubEncoding, architecture.latent, "texture's and mesh's sub-encodings to the mean code");
  linear("encoder.log_sigma_fc", 2 * kSubEncoding, architecture.latent, "the same to the code's log deviation");

  linear("decoder.code_fc", architecture.latent, kSubEncoding, "the code");
  linear("decoder.mesh_fc", kSubEncoding, mesh, "to the standardised vertices, x y z after x y z");
  if (architecture.conditioning == Conditioning::kFc8 || architecture.conditioning == Conditioning::kFc32) {
    linear("decoder.view_fc", 3, view, "the unit vector from the head's centre to the viewer, head space");
  }
  linear("decoder.texture_fc", view + kSubEncoding, inner, "view, then code, to the inner features");
  for (int i = 0, size = 2 * kInnerSize; i < depth; ++i, size *= 2) {
    const int in = channels[depth - 1 - i];
    const int out = i + 1 < depth ? channels[depth - 2 - i] : 3;
    layers.push_back({fmt::format("decoder.texture_conv.{}", i), LayerKind::kTransposedConvolution, in, out, size,
                      architecture.untied_bias != UntiedBias::kNone,
                      i + 1 < depth ? "doubles the texture's side" : "to the standardised texture of this view"});
  }
  return layers;
}

std::vector<TensorInfo> NetworkTensors(const Architecture& architecture) {
  std::vector<TensorInfo> tensors;
  for (const LayerInfo& layer : Layers(architecture)) {
    tensors.push_back({layer.name + ".weight", layer.WeightShape(), layer.meaning});
    tensors.push_back({layer.name + ".bias", layer.BiasShape(), "added to this layer's output"});
  }
  return tensors;
}

int64_t ParameterCount(const Architecture& architecture) {
  int64_t count = 0;
  for (const TensorInfo& tensor : NetworkTensors(architecture)) count += ElementCount(tensor.shape);
  return count;
}

int64_t ElementCount(const std::vector<int64_t>& shape) {
  int64_t count = 1;
  for (const int64_t extent : shape) count *= extent;
  return count;
}

}  // namespace likeness
