#include "likeness/train/network.h"

#include <ATen/CPUGeneratorImpl.h>

#include <cmath>

#include "likeness/base/error.h"
#include "likeness/train/ops/convolution.h"

namespace likeness {

namespace {

// The axes of a weight that belong to one output channel.
std::vector<int64_t> InnerAxes(const LayerInfo& info) {
  std::vector<int64_t> axes;
  for (int64_t axis = 0; axis < static_cast<int64_t>(info.WeightShape().size()); ++axis) {
    if (axis != info.OutputAxis()) axes.push_back(axis);
  }
  return axes;
}

// [out] -> a shape that multiplies the weight channel by channel.
torch::Tensor AlongOutputs(const LayerInfo& info, const torch::Tensor& values) {
  std::vector<int64_t> shape(info.WeightShape().size(), 1);
  shape[info.OutputAxis()] = info.out;
  return values.view(shape);
}

// How many inputs make up one output value.
double FanIn(const LayerInfo& info) {
  switch (info.kind) {
    case LayerKind::kLinear:
      return info.in;
    case LayerKind::kConvolution:
      return info.in * kKernel * kKernel;
    case LayerKind::kTransposedConvolution:
      return info.in * (kKernel / 2) * (kKernel / 2);  // stride 2: every second tap meets an output
  }
  return 1;
}

// The layers without an activation. Those that predict start small, near the mean texture, mesh and code.
constexpr double kHiddenGain = 1.387;  // sqrt(2 / (1 + 0.2^2)): keeps the variance through a leaky ReLU of 0.2
constexpr double kOutputGain = 0.1;
constexpr double kReferenceFanIn = 256;

bool IsOutput(const LayerInfo& info) {
  return info.name == "decoder.mesh_fc" || info.name == "encoder.log_sigma_fc" ||
         (info.kind == LayerKind::kTransposedConvolution && info.out == 3);
}

// Untied biases lie in memory as the features do, channels last.
torch::Tensor LaidOut(const torch::Tensor& bias) {
  return bias.dim() == 1 ? bias : bias.unsqueeze(0).contiguous(torch::MemoryFormat::ChannelsLast).squeeze(0);
}

torch::Tensor ToTorch(const Tensor& tensor, torch::TensorOptions options) {
  return torch::from_blob(const_cast<float*>(tensor.values.data()), tensor.shape, torch::kFloat32).to(options);
}

Tensor FromTorch(const torch::Tensor& tensor) {
  const torch::Tensor values = tensor.detach().to(torch::kCPU, torch::kFloat32).contiguous();
  const float* data = values.const_data_ptr<float>();
  return {values.sizes().vec(), std::vector<float>(data, data + values.numel())};
}

}  // namespace

Layer::Layer(const LayerInfo& info, Normalisation normalisation, double gain, torch::Generator generator,
             torch::TensorOptions options)
    : info_(info) {
  const double deviation = gain / std::sqrt(FanIn(info));
  weight_ = (torch::randn(info.WeightShape(), generator, torch::kFloat32) * deviation).to(options);
  bias_ = LaidOut(torch::zeros(info.BiasShape(), options));
  if (normalisation == Normalisation::kWeight) {
    gain_ = torch::sqrt(weight_.square().sum(InnerAxes(info)));
    // The direction's length is free. Adam moves every value by about the learning rate, so that an output moves by
    // gain x sqrt(fan-in) x rate / deviation: this makes it the same for all layers, where the 3 V inputs of a mesh
    // would otherwise run away at rates that suit the others.
    weight_ *= FanIn(info) / kReferenceFanIn;
  }
}

Layer::Layer(const LayerInfo& info, torch::Tensor weight, torch::Tensor bias)
    : info_(info), weight_(std::move(weight)), bias_(LaidOut(bias)) {}

torch::Tensor Layer::Weight() const {
  if (!gain_.defined()) return weight_;
  const torch::Tensor norm = torch::sqrt(weight_.square().sum(InnerAxes(info_)));
  return weight_ * AlongOutputs(info_, gain_ / norm);
}

torch::Tensor Layer::operator()(const torch::Tensor& x, double slope) const {
  switch (info_.kind) {
    case LayerKind::kLinear: {
      const torch::Tensor y = torch::linear(x.to(weight_.scalar_type()), Weight(), bias_);
      return slope == 1 ? y : torch::leaky_relu(y, slope);
    }
    case LayerKind::kConvolution:
      return ConvolveAndActivate(ConvolutionKind::kDown, x, Weight(), bias_, slope);
    case LayerKind::kTransposedConvolution:
      return ConvolveAndActivate(ConvolutionKind::kUp, x, Weight(), bias_, slope);
  }
  return {};
}

std::vector<Parameter> Layer::parameters() const {
  if (!gain_.defined()) return {{info_.name + ".weight", weight_}, {info_.name + ".bias", bias_}};
  return {{info_.name + ".direction", weight_}, {info_.name + ".gain", gain_}, {info_.name + ".bias", bias_}};
}

Network::Network(const Architecture& architecture, uint64_t seed, torch::TensorOptions options)
    : architecture_(architecture) {
  architecture.Check();
  torch::Generator generator = at::detail::createCPUGenerator(seed);
  for (const LayerInfo& info : Layers(architecture)) {
    layers_.emplace_back(info, architecture.normalisation, IsOutput(info) ? kOutputGain : kHiddenGain, generator,
                         options);
  }
  Connect();
}

Network::Network(const Architecture& architecture, const std::map<std::string, Tensor>& weights,
                 torch::TensorOptions options)
    : architecture_(architecture) {
  architecture.Check();
  for (const LayerInfo& info : Layers(architecture)) {
    layers_.emplace_back(info, ToTorch(weights.at(info.name + ".weight"), options),
                         ToTorch(weights.at(info.name + ".bias"), options));
  }
  Connect();
}

void Network::Connect() {
  for (const Layer& layer : layers_) {
    if (layer.info().kind == LayerKind::kConvolution) texture_encoder_.push_back(&layer);
    if (layer.info().kind == LayerKind::kTransposedConvolution) texture_decoder_.push_back(&layer);
    by_name_[layer.info().name] = &layer;
  }
}

const Layer& Network::layer(const std::string& name) const {
  const auto found = by_name_.find(name);
  LIKENESS_CHECK(found != by_name_.end());
  return *found->second;
}

Network::Encoding Network::Encode(const torch::Tensor& average_texture, const torch::Tensor& vertices) const {
  torch::Tensor features = average_texture;
  for (const Layer* convolution : texture_encoder_) features = (*convolution)(features, kLeakySlope);
  const torch::Tensor texture_code = layer("encoder.texture_fc")(features.flatten(1), kLeakySlope);
  const torch::Tensor mesh_code = layer("encoder.mesh_fc")(vertices, kLeakySlope);
  const torch::Tensor both = torch::cat({texture_code, mesh_code}, 1);
  return {layer("encoder.mu_fc")(both), layer("encoder.log_sigma_fc")(both)};
}

torch::Tensor Network::CodeFeatures(const torch::Tensor& code) const {
  return layer("decoder.code_fc")(code, kLeakySlope);
}

torch::Tensor Network::DecodeVertices(const torch::Tensor& code) const {
  return layer("decoder.mesh_fc")(CodeFeatures(code));
}

Network::Decoding Network::Decode(const torch::Tensor& code, const torch::Tensor& view) const {
  const torch::Tensor code_features = CodeFeatures(code);
  const torch::Tensor vertices = layer("decoder.mesh_fc")(code_features);

  const torch::Tensor view_features =
      by_name_.count("decoder.view_fc") != 0 ? layer("decoder.view_fc")(view, kLeakySlope) : view;
  torch::Tensor features = layer("decoder.texture_fc")(torch::cat({view_features, code_features}, 1), kLeakySlope);
  features =
      features.view({features.size(0), -1, kInnerSize, kInnerSize}).contiguous(torch::MemoryFormat::ChannelsLast);
  for (const Layer* convolution : texture_decoder_) {
    features = (*convolution)(features, convolution != texture_decoder_.back() ? kLeakySlope : 1);
  }
  return {features, vertices};
}

std::vector<Parameter> Network::parameters() const {
  std::vector<Parameter> all;
  for (const Layer& layer : layers_) {
    for (Parameter& parameter : layer.parameters()) all.push_back(std::move(parameter));
  }
  return all;
}

std::map<std::string, Tensor> Network::Folded() const {
  const torch::NoGradGuard no_grad;
  std::map<std::string, Tensor> weights;
  for (const Layer& layer : layers_) {
    weights[layer.info().name + ".weight"] = FromTorch(layer.Weight());
    weights[layer.info().name + ".bias"] = FromTorch(layer.bias());
  }
  return weights;
}

}  // namespace likeness
