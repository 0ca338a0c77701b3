#include "likeness/avatar/multiface/import.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/error.h"

namespace likeness {

namespace {

constexpr int kShrink = 256;  // S / side of the inner feature map

// Reverses the order of `rows` blocks of `block` values, in each of the runs that the values are made of.
void ReverseRows(std::vector<float>& values, int64_t rows, int64_t block) {
  for (auto run = values.begin(); run != values.end(); run += rows * block) {
    for (int64_t row = 0; row < rows / 2; ++row) {
      std::swap_ranges(run + row * block, run + (row + 1) * block, run + (rows - 1 - row) * block);
    }
  }
}

class Importer {
 public:
  Importer(const std::filesystem::path& path, const std::map<std::string, Tensor>& checkpoint)
      : path_(path), checkpoint_(checkpoint) {
    constexpr std::string_view kPrefix = "module.";
    if (checkpoint.begin()->first.starts_with(kPrefix)) prefix_ = kPrefix;
  }

  MultifaceNetwork Run() {
    MultifaceNetwork network;
    network.architecture = FindArchitecture();
    for (const LayerInfo& layer : Layers(network.architecture))
      ImportLayer(network.architecture, layer, network.weights);
    network.cameras = CountCameras();
    for (const auto& [name, tensor] : checkpoint_) {
      if (used_.count(name) == 0) {
        throw FileError(path_, fmt::format("holds a tensor that Multiface's network has not: '{}', [{}]", name,
                                           fmt::join(tensor.shape, ", ")));
      }
    }
    return network;
  }

 private:
  bool Has(const std::string& name) const { return checkpoint_.count(prefix_ + name) != 0; }

  const Tensor& Find(const std::string& name) {
    const auto found = checkpoint_.find(prefix_ + name);
    if (found == checkpoint_.end()) {
      throw FileError(path_, fmt::format("lacks the tensor '{}'; expected a checkpoint of Multiface's network "
                                         "DeepAppearanceVAE",
                                         name));
    }
    used_.insert(found->first);
    return found->second;
  }

  const Tensor& Find(const std::string& name, const std::vector<int64_t>& shape) {
    const Tensor& tensor = Find(name);
    if (tensor.shape != shape) {
      throw FileError(path_, fmt::format("its tensor '{}' is [{}]; expected [{}]", name, fmt::join(tensor.shape, ", "),
                                         fmt::join(shape, ", ")));
    }
    return tensor;
  }

  // The extent of a tensor's axis.
  int64_t Extent(const std::string& name, size_t axes, size_t axis) {
    const Tensor& tensor = Find(name);
    if (tensor.shape.size() != axes) {
      throw FileError(path_, fmt::format("its tensor '{}' has {} axes; expected {}", name, tensor.shape.size(), axes));
    }
    return tensor.shape[axis];
  }

  Architecture FindArchitecture() {
    Architecture a;
    a.preset = "multiface";
    a.layout = Layout::kMultiface;
    a.normalisation = Normalisation::kWeightTensor;
    const int64_t latent = Extent("dec.z_fc.weight", 2, 1), mesh = Extent("dec.mesh_fc.weight", 2, 0);
    const int64_t features = Extent("dec.texture_fc.weight", 2, 0);
    const double side = latent > 0 ? std::sqrt(static_cast<double>(features) / static_cast<double>(latent)) : 0;
    if (latent < 1 || latent > 4096 || mesh < 3 || mesh % 3 != 0 || mesh > 3'000'000 || side != std::floor(side) ||
        side < 1 || side > 16) {
      throw FileError(path_, fmt::format("its decoder turns codes of {} values into {} coordinates and {} features; "
                                         "that is no network of Multiface's",
                                         latent, mesh, features));
    }
    a.latent = static_cast<int>(latent);
    a.vertex_count = static_cast<int>(mesh / 3);
    a.texture_size = static_cast<int>(side) * kShrink;
    a.residual = Has("enc.texture_encoder.downsample.0.res1.weight");
    if (Extent("dec.texture_decoder.upsample.0.conv1.deconv.weight", 4, 2) == kSameKernel) {
      a.upsampling = Upsampling::kNearest;
    }
    const bool tied = Extent("dec.texture_decoder.upsample.0.conv1.bias", 4, 2) == 1;
    a.untied_bias = tied ? UntiedBias::kNone : UntiedBias::kDecoderAndChannel;
    try {
      a.Check();
    } catch (const Error& error) {
      throw FileError(path_, error.what());
    }
    return a;
  }

  // Our names end in the convolution's number; theirs count blocks of two convolutions.
  static std::string TheirName(const LayerInfo& layer) {
    static const std::map<std::string, std::string> kFullyConnected = {{"encoder.texture_fc", "enc.texture_fc"},
                                                                       {"encoder.mesh_fc", "enc.mesh_fc"},
                                                                       {"encoder.code_fc", "enc.fc"},
                                                                       {"decoder.code_fc", "dec.z_fc"},
                                                                       {"decoder.mesh_fc", "dec.mesh_fc"},
                                                                       {"decoder.view_fc", "dec.view_fc"},
                                                                       {"decoder.texture_fc", "dec.texture_fc"}};
    if (layer.kind == LayerKind::kLinear) return kFullyConnected.at(layer.name);
    const int number = std::stoi(layer.name.substr(layer.name.rfind('.') + 1));
    const bool encoder = layer.name.starts_with("encoder.");
    const bool residual = layer.kind == LayerKind::kSameConvolution;
    return fmt::format("{}.{}.{}{}{}", encoder ? "enc.texture_encoder.downsample" : "dec.texture_decoder.upsample",
                       number / 2, residual ? "res" : "conv", number % 2 + 1, encoder || residual ? "" : ".deconv");
  }

  void ImportLayer(const Architecture& a, const LayerInfo& layer, std::map<std::string, Tensor>& weights) {
    const std::string theirs = TheirName(layer);
    Tensor weight = Find(theirs + ".weight", layer.WeightShape());
    const Tensor& gain = Find(theirs + ".g", {layer.out});
    Fold(layer, gain, weight);

    Tensor bias{layer.BiasShape(), std::vector<float>(ElementCount(layer.BiasShape()), 0.0f)};
    const int64_t texels = static_cast<int64_t>(bias.values.size()) / layer.out;
    constexpr std::string_view kDeconv = ".deconv";
    const bool deconv = theirs.ends_with(kDeconv);
    // The convolution inside a block with a bias of its own need not have one.
    if (!deconv || Has(theirs + ".bias")) AddTo(bias, Find(theirs + ".bias", {layer.out}), texels);
    if (deconv) {
      const int64_t side = layer.untied_bias ? layer.out_size : 1;
      const std::string block = theirs.substr(0, theirs.size() - kDeconv.size());
      AddTo(bias, Find(block + ".bias", {1, layer.out, side, side}), 1);
    }

    const int64_t inner = InnerSize(a);
    if (layer.kind != LayerKind::kLinear) {
      ReverseRows(weight.values, weight.shape[2], weight.shape[3]);
      if (layer.untied_bias) ReverseRows(bias.values, layer.out_size, layer.out_size);
    } else if (layer.name == "encoder.texture_fc") {
      ReverseRows(weight.values, inner, inner);
    } else if (layer.name == "decoder.texture_fc") {
      ReverseRows(weight.values, inner, inner * layer.in);
      ReverseRows(bias.values, inner, inner);
    }
    weights[layer.name + ".weight"] = std::move(weight);
    weights[layer.name + ".bias"] = std::move(bias);
  }

  void Fold(const LayerInfo& layer, const Tensor& gain, Tensor& weight) const {
    double squares = 0;
    for (const float w : weight.values) squares += static_cast<double>(w) * w;
    if (!(squares > 0)) throw FileError(path_, fmt::format("the weight of '{}' is zero everywhere", layer.name));
    const double scale = 1 / std::sqrt(squares);
    int64_t inner = 1;  // values between two steps along the output axis
    for (size_t axis = layer.OutputAxis() + 1; axis < weight.shape.size(); ++axis) inner *= weight.shape[axis];
    for (size_t i = 0; i < weight.values.size(); ++i) {
      const double g = gain.values[static_cast<int64_t>(i) / inner % layer.out];
      weight.values[i] = static_cast<float>(weight.values[i] * g * scale);
    }
  }

  // Each of the added values to `repeat` neighbours.
  static void AddTo(Tensor& bias, const Tensor& added, int64_t repeat) {
    for (size_t i = 0; i < bias.values.size(); ++i) bias.values[i] += added.values[static_cast<int64_t>(i) / repeat];
  }

  int CountCameras() {
    if (!Has("cc.weight")) return 0;
    const int64_t others = Extent("cc.weight", 4, 0);
    if (others > 10'000) throw FileError(path_, fmt::format("has the colours of {} cameras", others + 1));
    for (const char* name : {"cc.weight", "cc.bias"}) Find(name, {others, 3, 1, 1});
    for (const char* name : {"cc.weight_anchor", "cc.bias_anchor"}) Find(name, {1, 3, 1, 1});
    return static_cast<int>(others) + 1;
  }

  const std::filesystem::path& path_;
  const std::map<std::string, Tensor>& checkpoint_;
  std::string prefix_;
  std::set<std::string> used_;
};

}  // namespace

MultifaceNetwork ImportMultiface(const std::filesystem::path& path, const std::map<std::string, Tensor>& checkpoint) {
  if (checkpoint.empty()) throw FileError(path, "holds no tensors");
  return Importer(path, checkpoint).Run();
}

}  // namespace likeness
