// The tensors of an architecture: names, shapes and meanings, once for the trainer, the avatar file and the run time.

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "likeness/avatar/architecture.h"

namespace likeness {

enum class LayerKind {
  kLinear,                 // weight [out, in]; y = W x + b
  kConvolution,            // weight [out, in, 4, 4]; stride 2, padding 1: halves the side
  kTransposedConvolution,  // weight [in, out, 4, 4]; stride 2, padding 1: doubles the side
  kUpsampledConvolution,   // weight [out, in, 3, 3]; doubles the side, every texel four times, then padding 1
  kSameConvolution,        // weight [out, in, 3, 3]; padding 1
  kConstant,               // no weight; y = b
};

// A layer has two tensors, NAME.weight and NAME.bias, a constant one the bias alone.
struct LayerInfo {
  std::string name;  // "decoder.texture_conv.0"
  LayerKind kind = LayerKind::kLinear;
  int in = 0;                // channels
  int out = 0;               // channels
  int out_size = 1;          // texels a side of the output
  bool untied_bias = false;  // bias [out, out_size, out_size], otherwise [out]
  std::string meaning;

  bool HasWeight() const { return kind != LayerKind::kConstant; }
  std::vector<int64_t> WeightShape() const;
  std::vector<int64_t> BiasShape() const;
  // Where the output channel stands in the weight's shape: weight normalisation has one norm for each of them.
  int OutputAxis() const { return kind == LayerKind::kTransposedConvolution ? 1 : 0; }
};

struct TensorInfo {
  std::string name;  // "decoder.texture_conv.0.weight"
  std::vector<int64_t> shape;
  std::string meaning;
};

// The learned identity vectors [identities, identity_size], a tensor that belongs to no layer.
inline constexpr char kIdentityVectors[] = "identity.vectors";

// In the order of the forward pass. Weights are effective ones: normalisation is folded in.
std::vector<LayerInfo> Layers(const Architecture& architecture);
std::vector<TensorInfo> NetworkTensors(const Architecture& architecture);

// Values in all of an architecture's tensors: the size of the network in a file.
int64_t ParameterCount(const Architecture& architecture);

int64_t ElementCount(const std::vector<int64_t>& shape);

}  // namespace likeness
