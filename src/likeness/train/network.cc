#include "likeness/train/network.h"

#include <ATen/CPUGeneratorImpl.h>
#include <fmt/format.h>

#include <cmath>

#include "likeness/base/error.h"
#include "likeness/train/bias_activation.h"
#include "likeness/train/ops/convolution.h"
#include "likeness/train/ops/normalised_linear.h"

namespace likeness {

namespace {

// The norms that divide a direction, [out]: of each output channel, or of the whole.
torch::Tensor Norms(const LayerInfo& info, const torch::Tensor& direction, bool whole) {
  const torch::Tensor squares = direction.square();
  if (whole) return torch::sqrt(squares.sum()).expand({info.out});
  std::vector<int64_t> axes;
  for (int64_t axis = 0; axis < direction.dim(); ++axis) {
    if (axis != info.OutputAxis()) axes.push_back(axis);
  }
  return torch::sqrt(squares.sum(axes));
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
    case LayerKind::kUpsampledConvolution:
    case LayerKind::kSameConvolution:
      return info.in * kSameKernel * kSameKernel;
    case LayerKind::kConstant:
      break;
  }
  return 1;
}

constexpr double kBatchMomentum = 0.1;  // of running statistics
constexpr double kBatchEpsilon = 1e-5;  // added to variances

// The direction's length is free. Adam moves every value by about the learning rate, so that an output moves by
// gain x sqrt(fan-in) x rate / deviation: this makes it the same for all layers, where the 3 V inputs of a mesh would
// otherwise run away at rates that suit the others.
double DirectionScale(const LayerInfo& info) {
  constexpr double kReferenceFanIn = 256;
  return FanIn(info) / kReferenceFanIn;
}

// The layers without an activation. Those that predict start small, near the mean texture, mesh and code.
constexpr double kHiddenGain = 1.387;  // sqrt(2 / (1 + 0.2^2)): keeps the variance through a leaky ReLU of 0.2
constexpr double kOutputGain = 0.1;

// A linear model's code is the sum of two layers' outputs.
constexpr double kLinearGain = M_SQRT1_2;

bool IsOutput(const LayerInfo& info, const Architecture& architecture) {
  if (architecture.model != ModelKind::kDeep) return info.name.starts_with("decoder.");
  const size_t last = DecoderChannels(architecture).size() - 2;
  return info.name == "decoder.mesh_fc" || info.name == "encoder.log_sigma_fc" ||
         info.name == fmt::format("decoder.texture_conv.{}", last) ||
         info.name == fmt::format("decoder.texture_res.{}", last);
}

// Untied biases lie in memory as the features do, channels last.
torch::Tensor LaidOut(const torch::Tensor& bias) {
  return bias.dim() == 1 ? bias : bias.unsqueeze(0).contiguous(torch::MemoryFormat::ChannelsLast).squeeze(0);
}

// The layer's linear part. `bias` is [out] or undefined.
torch::Tensor Apply(const LayerInfo& info, const torch::Tensor& any, const torch::Tensor& weight,
                    const torch::Tensor& bias) {
  if (info.kind == LayerKind::kConstant) return bias.expand({any.size(0), info.out});
  const torch::Tensor x = any.to(weight.scalar_type());
  switch (info.kind) {
    case LayerKind::kLinear:
      return torch::linear(x, weight, bias);
    case LayerKind::kConvolution:
      return torch::conv2d(x, weight, bias, /*stride=*/2, /*padding=*/1);
    case LayerKind::kTransposedConvolution:
      return torch::conv_transpose2d(x, weight, bias, /*stride=*/2, /*padding=*/1);
    case LayerKind::kUpsampledConvolution:
      return torch::conv2d(torch::upsample_nearest2d(x, {2 * x.size(2), 2 * x.size(3)}), weight, bias, /*stride=*/1,
                           /*padding=*/1);
    case LayerKind::kSameConvolution:
      return torch::conv2d(x, weight, bias, /*stride=*/1, /*padding=*/1);
    case LayerKind::kConstant:
      break;
  }
  return {};
}

// act(x + layer(x)).
torch::Tensor Residual(const Layer& layer, const torch::Tensor& x, double slope) {
  const torch::Tensor y = x + layer(x);
  return slope == 1 ? y : torch::leaky_relu(y, slope);
}

double GainOf(const LayerInfo& info, const Architecture& architecture) {
  if (IsOutput(info, architecture)) return kOutputGain;
  return architecture.model == ModelKind::kDeep ? kHiddenGain : kLinearGain;
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

Layer::Layer(const LayerInfo& info, const Architecture& architecture, double gain, torch::Generator generator,
             torch::TensorOptions options)
    : info_(info), whole_(architecture.normalisation == Normalisation::kWeightTensor) {
  bias_ = LaidOut(torch::zeros(info.BiasShape(), options));
  if (!info.HasWeight()) return;
  const double deviation = gain / std::sqrt(FanIn(info));
  weight_ = (torch::randn(info.WeightShape(), generator, torch::kFloat32) * deviation).to(options);
  if (info.untied_bias && architecture.untied_bias == UntiedBias::kDecoderAndChannel) {
    channel_bias_ = torch::zeros(info.out, options);
  }
  switch (architecture.normalisation) {
    case Normalisation::kNone:
      break;
    case Normalisation::kBatch:
      if (info.kind == LayerKind::kLinear || info.kind == LayerKind::kSameConvolution || IsOutput(info, architecture)) {
        break;
      }
      gain_ = torch::ones(info.out, options);
      mean_ = torch::zeros(info.out, options);
      variance_ = torch::ones(info.out, options);
      break;
    case Normalisation::kWeight:
      gain_ = Norms(info, weight_, whole_);
      weight_ *= DirectionScale(info);
      break;
    case Normalisation::kWeightTensor:
      gain_ = Norms(info, weight_, whole_).clone();
      break;
  }
}

Layer::Layer(const LayerInfo& info, torch::Tensor weight, torch::Tensor bias)
    : info_(info), weight_(std::move(weight)), bias_(LaidOut(bias)) {}

void Layer::Take(const Tensor* weight, const Tensor& bias) {
  LIKENESS_CHECK(!mean_.defined() && (weight != nullptr) == weight_.defined());
  const torch::NoGradGuard no_grad;
  bias_.copy_(ToTorch(bias, bias_.options()));
  if (channel_bias_.defined()) channel_bias_.zero_();
  if (weight == nullptr) return;
  weight_.copy_(ToTorch(*weight, weight_.options()));
  if (!gain_.defined()) return;
  gain_.copy_(Norms(info_, weight_, whole_));
  if (!whole_) weight_ *= DirectionScale(info_);
}

torch::Tensor Layer::BatchScale() const { return gain_ / torch::sqrt(variance_ + kBatchEpsilon); }

torch::Tensor Layer::Weight() const {
  if (!gain_.defined()) return weight_;
  return weight_ * AlongOutputs(info_, mean_.defined() ? BatchScale() : gain_ / Norms(info_, weight_, whole_));
}

torch::Tensor Layer::Bias() const {
  torch::Tensor shift = channel_bias_;
  if (mean_.defined()) shift = (shift.defined() ? shift : torch::zeros_like(mean_)) - BatchScale() * mean_;
  if (!shift.defined()) return bias_;
  return bias_ + (info_.untied_bias ? shift.view({-1, 1, 1}) : shift);
}

torch::Tensor Layer::operator()(const torch::Tensor& x, double slope) const {
  if (mean_.defined()) return BatchNormalised(x, slope);
  if (info_.kind == LayerKind::kConvolution || info_.kind == LayerKind::kTransposedConvolution) {
    const auto kind = info_.kind == LayerKind::kConvolution ? ConvolutionKind::kDown : ConvolutionKind::kUp;
    return ConvolveAndActivate(kind, x, Weight(), Bias(), slope);
  }
  if (info_.kind == LayerKind::kLinear && gain_.defined()) {
    const torch::Tensor y = NormalisedLinear(x.to(weight_.scalar_type()), weight_, gain_, whole_, bias_);
    return slope == 1 ? y : torch::leaky_relu(y, slope);
  }
  const torch::Tensor y = Apply(info_, x, Weight(), info_.untied_bias ? channel_bias_ : bias_);
  if (info_.untied_bias) return AddBiasAndActivate(y, bias_, slope);
  return slope == 1 ? y : torch::leaky_relu(y, slope);
}

torch::Tensor Layer::BatchNormalised(const torch::Tensor& x, double slope) const {
  const torch::Tensor y = torch::batch_norm(Apply(info_, x, weight_, {}), gain_,
                                            info_.untied_bias ? channel_bias_ : bias_, mean_, variance_,
                                            /*training=*/torch::GradMode::is_enabled(), kBatchMomentum, kBatchEpsilon,
                                            /*cudnn_enabled=*/x.is_cuda());
  if (info_.untied_bias) return AddBiasAndActivate(y, bias_, slope);
  return slope == 1 ? y : torch::leaky_relu(y, slope);
}

std::vector<Parameter> Layer::parameters() const {
  const bool direction = gain_.defined() && !mean_.defined();
  std::vector<Parameter> all;
  if (info_.HasWeight()) all.push_back({info_.name + (direction ? ".direction" : ".weight"), weight_});
  if (gain_.defined()) all.push_back({info_.name + ".gain", gain_});
  if (channel_bias_.defined()) all.push_back({info_.name + ".channel_bias", channel_bias_});
  all.push_back({info_.name + ".bias", bias_});
  return all;
}

std::vector<Parameter> Layer::statistics() const {
  if (!mean_.defined()) return {};
  return {{info_.name + ".mean", mean_}, {info_.name + ".variance", variance_}};
}

Network::Network(const Architecture& architecture, uint64_t seed, torch::TensorOptions options,
                 const ColourOptions& colours)
    : architecture_(architecture), colours_(colours), options_(options) {
  if (colours.cameras > 0) {
    colour_gain_ = torch::zeros({colours.cameras - 1, 3}, options);
    colour_bias_ = torch::zeros({colours.cameras - 1, 3}, options);
  }
  architecture.Check();
  torch::Generator generator = at::detail::createCPUGenerator(seed);
  for (const LayerInfo& info : Layers(architecture)) {
    layers_.emplace_back(info, architecture, GainOf(info, architecture), generator, options);
  }
  if (architecture.identity == IdentityConditioning::kLearned) {
    identity_vectors_ = torch::randn({architecture.identities, architecture.identity_size}, generator,
                                     torch::TensorOptions(torch::kFloat32))
                            .to(options);
  }
  Connect();
}

Network::Network(const Architecture& architecture, const std::map<std::string, Tensor>& weights,
                 torch::TensorOptions options)
    : architecture_(architecture), options_(options) {
  architecture.Check();
  for (const LayerInfo& info : Layers(architecture)) {
    layers_.emplace_back(info, info.HasWeight() ? ToTorch(weights.at(info.name + ".weight"), options) : torch::Tensor(),
                         ToTorch(weights.at(info.name + ".bias"), options));
  }
  if (architecture.identity == IdentityConditioning::kLearned) {
    identity_vectors_ = ToTorch(weights.at(kIdentityVectors), options);
  }
  Connect();
}

void Network::Connect() {
  for (const Layer& layer : layers_) by_name_[layer.info().name] = &layer;
  if (architecture_.model != ModelKind::kDeep) return;
  for (size_t i = 0; i < EncoderChannels(architecture_).size(); ++i) texture_encoder_.push_back(StageOf("encoder", i));
  for (size_t i = 1; i < DecoderChannels(architecture_).size(); ++i) {
    texture_decoder_.push_back(StageOf("decoder", i - 1));
  }
}

Network::TextureStage Network::StageOf(const std::string& network, size_t index) const {
  const auto find = [&](const char* part) {
    const auto found = by_name_.find(fmt::format("{}.{}.{}", network, part, index));
    return found == by_name_.end() ? nullptr : found->second;
  };
  return {find("view_add"), find("texture_conv"), find("texture_res")};
}

const Layer& Network::layer(const std::string& name) const {
  const auto found = by_name_.find(name);
  LIKENESS_CHECK(found != by_name_.end());
  return *found->second;
}

torch::Tensor Network::Condition(const torch::Tensor& identity, const torch::Tensor& named) const {
  std::vector<torch::Tensor> parts;
  if (architecture_.identity == IdentityConditioning::kOneHot) {
    parts.push_back(torch::one_hot(identity, architecture_.identities).to(options_));
  }
  if (architecture_.identity == IdentityConditioning::kLearned) {
    parts.push_back(identity_vectors_.index_select(0, identity));
  }
  if (NamedChannels(architecture_) > 0) parts.push_back(named.to(options_));
  return parts.empty() ? torch::Tensor() : torch::cat(parts, 1);
}

torch::Tensor Network::Beside(const torch::Tensor& values, const torch::Tensor& condition) const {
  LIKENESS_CHECK((condition.defined() ? condition.size(1) : 0) == ConditionChannels(architecture_));
  return condition.defined() ? torch::cat({values, condition}, 1) : values;
}

Network::Encoding Network::Encode(const torch::Tensor& average_texture, const torch::Tensor& vertices,
                                  const torch::Tensor& condition) const {
  if (architecture_.model != ModelKind::kDeep) return EncodeLinearly(average_texture, vertices, condition);
  torch::Tensor features = average_texture;
  for (const TextureStage& stage : texture_encoder_) {
    features = (*stage.convolution)(features, kLeakySlope);
    if (stage.residual != nullptr) features = Residual(*stage.residual, features, kLeakySlope);
  }
  const torch::Tensor texture_code = layer("encoder.texture_fc")(features.flatten(1), kLeakySlope);
  const torch::Tensor mesh_code = layer("encoder.mesh_fc")(vertices, kLeakySlope);
  const torch::Tensor both = Beside(torch::cat({texture_code, mesh_code}, 1), condition);
  if (architecture_.layout == Layout::kPaper)
    return {layer("encoder.mu_fc")(both), layer("encoder.log_sigma_fc")(both)};
  const std::vector<torch::Tensor> code = layer("encoder.code_fc")(both).chunk(2, 1);
  const EncoderScales scales = ScalesOf(architecture_);
  return {code[0] * scales.mu, code[1] * scales.log_sigma};
}

// Textures lie in memory with red, green and blue of a texel side by side: no copy is made here.
Network::Encoding Network::EncodeLinearly(const torch::Tensor& average_texture, const torch::Tensor& vertices,
                                          const torch::Tensor& condition) const {
  const torch::Tensor texels = average_texture.permute({0, 2, 3, 1}).flatten(1);
  return {layer("encoder.texture_fc")(texels) + layer("encoder.mesh_fc")(Beside(vertices, condition)),
          layer("encoder.log_sigma")(texels)};
}

torch::Tensor Network::DecodeTextureLinearly(const torch::Tensor& state, const torch::Tensor& view) const {
  const bool bilinear = architecture_.model == ModelKind::kBilinear;
  const torch::Tensor factors = bilinear ? (view.unsqueeze(2) * state.unsqueeze(1)).flatten(1) : state;
  const int64_t size = architecture_.texture_size;
  return layer("decoder.texture_fc")(factors).view({-1, size, size, 3}).permute({0, 3, 1, 2});
}

torch::Tensor Network::StateFeatures(const torch::Tensor& state) const {
  if (architecture_.model != ModelKind::kDeep) return state;
  return layer("decoder.code_fc")(state, kLeakySlope);
}

torch::Tensor Network::DecodeVertices(const torch::Tensor& code, const torch::Tensor& condition) const {
  return layer("decoder.mesh_fc")(StateFeatures(Beside(code, condition)));
}

Network::Decoding Network::Decode(const torch::Tensor& code, const torch::Tensor& view,
                                  const torch::Tensor& condition) const {
  const torch::Tensor state = Beside(code, condition);
  const torch::Tensor state_features = StateFeatures(state);
  const torch::Tensor vertices = layer("decoder.mesh_fc")(state_features);

  if (architecture_.model != ModelKind::kDeep) return {DecodeTextureLinearly(state, view), vertices};

  const torch::Tensor view_features =
      by_name_.count("decoder.view_fc") != 0 ? layer("decoder.view_fc")(view, kLeakySlope) : view;
  const torch::Tensor joined =
      ViewInAllLayers(architecture_) ? state_features : torch::cat({view_features, state_features}, 1);
  torch::Tensor features = layer("decoder.texture_fc")(joined, kLeakySlope);
  const int64_t inner = InnerSize(architecture_);
  features = features.view({features.size(0), -1, inner, inner}).contiguous(torch::MemoryFormat::ChannelsLast);
  for (const TextureStage& stage : texture_decoder_) {
    const double slope = &stage != &texture_decoder_.back() ? kLeakySlope : 1;
    if (stage.view != nullptr) features = features + (*stage.view)(view_features).unsqueeze(-1).unsqueeze(-1);
    features = (*stage.convolution)(features, slope);
    if (stage.residual != nullptr) features = Residual(*stage.residual, features, slope);
  }
  return {features, vertices};
}

torch::Tensor Network::InCameraColours(const torch::Tensor& texture, const torch::Tensor& camera) const {
  if (colours_.cameras == 0) return texture;
  const auto of_camera = [&](const torch::Tensor& values) {
    const torch::Tensor first = torch::zeros({1, 3}, values.options());
    return colours_.rate * torch::cat({first, values}).index_select(0, camera).view({-1, 3, 1, 1});
  };
  return texture * (1 + of_camera(colour_gain_)) + of_camera(colour_bias_);
}

std::vector<Parameter> Network::parameters() const {
  std::vector<Parameter> all;
  if (colours_.cameras > 1) all = {{"colour.gain", colour_gain_}, {"colour.bias", colour_bias_}};
  if (identity_vectors_.defined()) all.push_back({kIdentityVectors, identity_vectors_});
  for (const Layer& layer : layers_) {
    for (Parameter& parameter : layer.parameters()) all.push_back(std::move(parameter));
  }
  return all;
}

std::vector<Parameter> Network::statistics() const {
  std::vector<Parameter> all;
  for (const Layer& layer : layers_) {
    for (Parameter& statistic : layer.statistics()) all.push_back(std::move(statistic));
  }
  return all;
}

void Network::Take(const std::map<std::string, Tensor>& weights) {
  const torch::NoGradGuard no_grad;
  if (identity_vectors_.defined()) identity_vectors_.copy_(ToTorch(weights.at(kIdentityVectors), options_));
  for (Layer& layer : layers_) {
    const std::string& name = layer.info().name;
    layer.Take(layer.info().HasWeight() ? &weights.at(name + ".weight") : nullptr, weights.at(name + ".bias"));
  }
}

std::map<std::string, Tensor> Network::Folded() const {
  const torch::NoGradGuard no_grad;
  std::map<std::string, Tensor> weights;
  if (identity_vectors_.defined()) weights[kIdentityVectors] = FromTorch(identity_vectors_);
  for (const Layer& layer : layers_) {
    if (layer.info().HasWeight()) weights[layer.info().name + ".weight"] = FromTorch(layer.Weight());
    weights[layer.info().name + ".bias"] = FromTorch(layer.Bias());
  }
  return weights;
}

}  // namespace likeness
