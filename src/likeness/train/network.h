// The avatar's network on LibTorch: encoder and decoder of the architecture, trainable or as an avatar file holds them.

#pragma once

#include <torch/types.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "likeness/avatar/avatar.h"
#include "likeness/avatar/tensor_registry.h"

namespace likeness {

// A tensor that the optimiser changes.
struct Parameter {
  std::string name;  // "decoder.mesh_fc.direction"
  torch::Tensor value;
};

// One layer of the registry. Its parameters are NAME.bias and, by the architecture's normalisation,
//   none           NAME.weight
//   batch          NAME.weight and NAME.gain [out]: features are gain (x - mean) / deviation before the bias, over
//   batch
//                  and texels (Ioffe & Szegedy 2015). While gradients are recorded mean and deviation are the batch's
//                  own, and the running ones, NAME.mean and NAME.variance, follow; otherwise they are the running ones.
//                  Convolutions alone, but for the one that gives the texture
//   weight         NAME.direction and NAME.gain [out]: the weight of each output channel o is
//                  gain_o * direction_o / |direction_o| (Salimans & Kingma 2016, equation 2)
//   weight-tensor  the same with |direction| for |direction_o|
// and NAME.channel_bias [out] where UntiedBias says so.
class Layer {
 public:
  // Random weights: normal, scaled so that inputs of mean square 1 give outputs of mean square gain^2. Biases are zero.
  Layer(const LayerInfo& info, const Architecture& architecture, double gain, torch::Generator generator,
        torch::TensorOptions options);
  // Weights as they are.
  Layer(const LayerInfo& info, torch::Tensor weight, torch::Tensor bias);

  // leaky_relu(weight x + bias); a slope of 1 is no activation.
  //   x        [N, in] for a linear layer, [N, in, H, W] otherwise
  //   returns  [N, out], or [N, out, h, w] with the sides that the kind gives
  torch::Tensor operator()(const torch::Tensor& x, double slope = 1) const;

  // Sets the parameters to such that the layer has these effective weights, in the registry's shapes. Not under batch
  // normalisation, whose statistics are no part of them.
  //   weight  null: the layer has none
  void Take(const Tensor* weight, const Tensor& bias);

  const LayerInfo& info() const { return info_; }
  // Effective, in the registry's shapes: with running statistics and gains multiplied in.
  torch::Tensor Weight() const;
  torch::Tensor Bias() const;
  std::vector<Parameter> parameters() const;
  std::vector<Parameter> statistics() const;

 private:
  torch::Tensor BatchNormalised(const torch::Tensor& x, double slope) const;
  torch::Tensor BatchScale() const;

  LayerInfo info_;
  torch::Tensor weight_;    // the direction under weight normalisation
  torch::Tensor gain_;      // [out]; undefined without normalisation
  bool whole_ = false;      // one norm for the whole weight
  torch::Tensor mean_;      // [out], of features without bias; undefined without batch normalisation
  torch::Tensor variance_;  // [out]
  torch::Tensor bias_;
  torch::Tensor channel_bias_;  // [out]; mostly undefined
};

// A gain and a bias for each training camera and colour on the standardised texture, as in Multiface: cameras differ in
// their colours, and the avatar should not. The first camera's are 1 and 0. They are no part of an avatar file, which
// has the first camera's colours.
struct ColourOptions {
  int cameras = 0;  // 0: no colours
  double rate =
      1;  // their learning rate, times the network's: gain = 1 + rate * colour.gain, and the same for the bias
};

// Everything is standardised: textures [N, 3, S, S] with row 0 at v = 1, vertices [N, 3 V] x y z after x y z, named
// conditions [N, NamedChannels].
class Network {
 public:
  // Random weights by seed, on options' device and of its type (float32; float64 for tests).
  Network(const Architecture& architecture, uint64_t seed, torch::TensorOptions options = torch::kFloat32,
          const ColourOptions& colours = {});
  // The weights of an avatar file; they are borrowed where options name the CPU and float32, so keep them alive.
  Network(const Architecture& architecture, const std::map<std::string, Tensor>& weights,
          torch::TensorOptions options = torch::kFloat32);
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  struct Encoding {
    torch::Tensor mu;         // [N, latent]
    torch::Tensor log_sigma;  // [N, latent]
  };
  //   condition  [N, ConditionChannels], see Condition; undefined where the architecture has none
  Encoding Encode(const torch::Tensor& average_texture, const torch::Tensor& vertices,
                  const torch::Tensor& condition = {}) const;

  struct Decoding {
    torch::Tensor texture;   // [N, 3, S, S]
    torch::Tensor vertices;  // [N, 3 V]
  };
  //   code  [N, latent]
  //   view  [N, 3] unit vectors from the head's centre to the viewer, head space
  Decoding Decode(const torch::Tensor& code, const torch::Tensor& view, const torch::Tensor& condition = {}) const;
  // The vertices alone: they do not depend on the view.
  torch::Tensor DecodeVertices(const torch::Tensor& code, const torch::Tensor& condition = {}) const;

  // The condition vector c: who it is, then the named conditions. Undefined where the architecture has none.
  //   identity  [N] int64, index of the person
  //   named     [N, NamedChannels]
  torch::Tensor Condition(const torch::Tensor& identity, const torch::Tensor& named) const;

  // The texture as the cameras have it: gain * texture + bias. Without colours, the texture.
  //   camera  [N] int64, index of the training camera
  torch::Tensor InCameraColours(const torch::Tensor& texture, const torch::Tensor& camera) const;

  const Architecture& architecture() const { return architecture_; }
  const Layer& layer(const std::string& name) const;

  // All parameters, in the registry's order; they share memory with the network.
  std::vector<Parameter> parameters() const;
  // Running statistics, which no gradient moves: there are some with batch normalisation alone.
  std::vector<Parameter> statistics() const;

  // Goes on from an avatar file's weights, of the same architecture; they are copied. Not under batch normalisation.
  void Take(const std::map<std::string, Tensor>& weights);

  // The effective weights, as an avatar file holds them.
  std::map<std::string, Tensor> Folded() const;

 private:
  void Connect();
  torch::Tensor Beside(const torch::Tensor& values, const torch::Tensor& condition) const;
  torch::Tensor StateFeatures(const torch::Tensor& state) const;

  Architecture architecture_;
  ColourOptions colours_;
  torch::TensorOptions options_;
  torch::Tensor colour_gain_, colour_bias_;  // [cameras - 1, 3]
  torch::Tensor identity_vectors_;           // [identities, identity_size]; undefined unless they are learned
  std::vector<Layer> layers_;                // in the registry's order; fixed after construction
  std::map<std::string, const Layer*> by_name_;
  // A convolution, with what can stand before and after it.
  struct TextureStage {
    const Layer* view = nullptr;
    const Layer* convolution = nullptr;
    const Layer* residual = nullptr;
  };
  Encoding EncodeLinearly(const torch::Tensor& average_texture, const torch::Tensor& vertices,
                          const torch::Tensor& condition) const;
  torch::Tensor DecodeTextureLinearly(const torch::Tensor& state, const torch::Tensor& view) const;
  TextureStage StageOf(const std::string& network, size_t index) const;
  std::vector<TextureStage> texture_encoder_;  // from the image inwards
  std::vector<TextureStage> texture_decoder_;  // from the inside to the image
};

}  // namespace likeness
