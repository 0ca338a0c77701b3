#include "likeness/avatar/tensor_registry.h"

#include <fmt/format.h>

#include "likeness/base/error.h"

namespace likeness {

namespace {

void AddLinear(std::vector<LayerInfo>& layers, const std::string& name, int in, int out, const std::string& meaning) {
  layers.push_back({name, LayerKind::kLinear, in, out, 1, false, meaning});
}

void AddEncoder(const Architecture& a, std::vector<LayerInfo>& layers) {
  const std::vector<int> channels = EncoderChannels(a);
  const bool untied = a.untied_bias == UntiedBias::kEverywhere;
  for (int i = 0, in = 3, size = a.texture_size / 2; i < static_cast<int>(channels.size()); ++i, size /= 2) {
    const int out = channels[i];
    layers.push_back({fmt::format("encoder.texture_conv.{}", i), LayerKind::kConvolution, in, out, size, untied,
                      "halves the standardised average texture's side"});
    if (a.residual) {
      layers.push_back({fmt::format("encoder.texture_res.{}", i), LayerKind::kSameConvolution, out, out, size, false,
                        "is added to the features it is made from"});
    }
    in = out;
  }
  const int inner = channels.back() * InnerSize(a) * InnerSize(a);
  const int both = 2 * kSubEncoding + ConditionChannels(a);
  AddLinear(layers, "encoder.texture_fc", inner, kSubEncoding, "the inner features, channel by channel and row by row");
  AddLinear(layers, "encoder.mesh_fc", 3 * a.vertex_count, kSubEncoding,
            "the standardised vertices, x y z after x y z");
  if (a.layout == Layout::kMultiface) {
    AddLinear(layers, "encoder.code_fc", both, 2 * a.latent,
              "texture's and mesh's sub-encodings and the condition vector to the mean code / 0.1, then its log "
              "deviation / 0.01");
    return;
  }
  AddLinear(layers, "encoder.mu_fc", both, a.latent,
            "texture's and mesh's sub-encodings and the condition vector to the mean code");
  AddLinear(layers, "encoder.log_sigma_fc", both, a.latent, "the same to the code's log deviation");
}

void AddDecoder(const Architecture& a, std::vector<LayerInfo>& layers) {
  const std::vector<int> channels = DecoderChannels(a);
  const int inner = channels.front() * InnerSize(a) * InnerSize(a), view = ViewChannels(a);
  const int stages = static_cast<int>(channels.size()) - 1;
  const bool all = ViewInAllLayers(a), untied = a.untied_bias != UntiedBias::kNone;
  AddLinear(layers, "decoder.code_fc", a.latent + ConditionChannels(a), kSubEncoding,
            "the code, then the condition vector");
  AddLinear(layers, "decoder.mesh_fc", kSubEncoding, 3 * a.vertex_count,
            "to the standardised vertices, x y z after x y z");
  if (a.conditioning != Conditioning::kRaw && a.conditioning != Conditioning::kRawAll) {
    AddLinear(layers, "decoder.view_fc", 3, view, "the unit vector from the head's centre to the viewer, head space");
  }
  AddLinear(layers, "decoder.texture_fc", all ? kSubEncoding : view + kSubEncoding, inner,
            all ? "the code to the inner features" : "view, then code, to the inner features");
  for (int i = 0, size = 2 * InnerSize(a); i < stages; ++i, size *= 2) {
    const int in = channels[i], out = channels[i + 1];
    const bool last = i + 1 == stages;
    if (all) {
      AddLinear(layers, fmt::format("decoder.view_add.{}", i), view, in,
                "the view, added to the next layer's input at every texel");
    }
    layers.push_back(
        {fmt::format("decoder.texture_conv.{}", i),
         a.upsampling == Upsampling::kNearest ? LayerKind::kUpsampledConvolution : LayerKind::kTransposedConvolution,
         in, out, size, untied, last ? "to the standardised texture of this view" : "doubles the texture's side"});
    if (a.residual) {
      layers.push_back({fmt::format("decoder.texture_res.{}", i), LayerKind::kSameConvolution, out, out, size, false,
                        "is added to the features it is made from"});
    }
  }
}

void AddLinearModel(const Architecture& a, std::vector<LayerInfo>& layers) {
  const int texture = 3 * a.texture_size * a.texture_size, mesh = 3 * a.vertex_count;
  const int condition = ConditionChannels(a), state = a.latent + condition;
  const bool bilinear = a.model == ModelKind::kBilinear;
  AddLinear(layers, "encoder.texture_fc", texture, a.latent,
            "the standardised average texture, red green blue after red green blue, row by row; added to the next");
  AddLinear(layers, "encoder.mesh_fc", mesh + condition, a.latent,
            "the standardised vertices, then the condition vector; the sum is the mean code");
  layers.push_back({"encoder.log_sigma", LayerKind::kConstant, 0, a.latent, 1, false, "the code's log deviation"});
  AddLinear(layers, "decoder.mesh_fc", state, mesh,
            "the code, then the condition vector, to the standardised vertices, x y z after x y z");
  AddLinear(layers, "decoder.texture_fc", bilinear ? 3 * state : state, texture,
            bilinear ? "code and condition vector times the view's x, then y, then z, to the standardised texture"
                     : "the same to the standardised texture");
}

}  // namespace

std::vector<int64_t> LayerInfo::WeightShape() const {
  switch (kind) {
    case LayerKind::kLinear:
      return {out, in};
    case LayerKind::kConvolution:
      return {out, in, kKernel, kKernel};
    case LayerKind::kTransposedConvolution:
      return {in, out, kKernel, kKernel};
    case LayerKind::kUpsampledConvolution:
    case LayerKind::kSameConvolution:
      return {out, in, kSameKernel, kSameKernel};
    case LayerKind::kConstant:
      break;
  }
  return {};
}

std::vector<int64_t> LayerInfo::BiasShape() const {
  if (untied_bias) return {out, out_size, out_size};
  return {out};
}

std::vector<LayerInfo> Layers(const Architecture& architecture) {
  LIKENESS_CHECK(architecture.vertex_count > 0);
  std::vector<LayerInfo> layers;
  if (architecture.model == ModelKind::kDeep) {
    AddEncoder(architecture, layers);
    AddDecoder(architecture, layers);
  } else {
    AddLinearModel(architecture, layers);
  }
  return layers;
}

std::vector<TensorInfo> NetworkTensors(const Architecture& architecture) {
  std::vector<TensorInfo> tensors;
  if (architecture.identity == IdentityConditioning::kLearned) {
    tensors.push_back({kIdentityVectors,
                       {architecture.identities, architecture.identity_size},
                       "the first values of the condition vector, a row a person"});
  }
  for (const LayerInfo& layer : Layers(architecture)) {
    if (layer.HasWeight()) tensors.push_back({layer.name + ".weight", layer.WeightShape(), layer.meaning});
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
