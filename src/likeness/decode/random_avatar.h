// Avatars with random weights, for tests and benchmarks.

#pragma once

#include <cmath>
#include <string>

#include "likeness/avatar/avatar.h"
#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/random.h"

namespace likeness {

// Features keep their scale from layer to layer; textures have a deviation of some 30 about a mean of some 128,
// vertices one of 2 mm. The encoder's weights are zero.
inline Avatar RandomAvatar(const Architecture& architecture, uint64_t seed) {
  Avatar avatar;
  avatar.architecture = architecture;
  Random random(seed);
  const auto values = [&](int64_t count, double mean, double deviation) {
    std::vector<float> all(static_cast<size_t>(count));
    for (float& v : all) v = static_cast<float>(mean + deviation * (random.Uniform() - 0.5) * std::sqrt(12.0));
    return all;
  };
  for (const LayerInfo& layer : Layers(architecture)) {
    const bool used = layer.name.starts_with("decoder.");
    const bool up = layer.kind == LayerKind::kTransposedConvolution;
    const double fan_in = layer.kind == LayerKind::kLinear ? layer.in : layer.in * (up ? 4.0 : 9.0);
    const bool residual = layer.kind == LayerKind::kSameConvolution;
    const double scale = (residual ? 0.5 : 1.2) / std::sqrt(std::max(1.0, fan_in));
    if (layer.HasWeight()) {
      avatar.weights[layer.name + ".weight"] = {layer.WeightShape(),
                                                values(ElementCount(layer.WeightShape()), 0, used ? scale : 0)};
    }
    avatar.weights[layer.name + ".bias"] = {layer.BiasShape(),
                                            values(ElementCount(layer.BiasShape()), 0, used ? 0.3 : 0)};
  }
  const int size = architecture.texture_size, vertices = architecture.vertex_count;
  avatar.identities.resize(architecture.identities);
  for (Identity& identity : avatar.identities) {
    if (architecture.identities > 1) identity.name = "person_" + std::to_string(&identity - avatar.identities.data());
    identity.texture_mean = ImageF(size, size, 3);
    for (float& v : identity.texture_mean.values()) v = static_cast<float>(random.Uniform(80, 170));
    identity.vertex_mean = Vertices(vertices, 3);
    for (int i = 0; i < 3 * vertices; ++i) {
      identity.vertex_mean.data()[i] = static_cast<float>(random.Uniform(-100, 100));
    }
  }
  avatar.texture_variance = 900;
  avatar.vertex_variance = 4;
  avatar.topology.vertex_count = vertices;
  avatar.topology.uvs = {{0, 0}, {1, 0}, {0, 1}};
  avatar.topology.triangles = {{0, 1 % vertices, 2 % vertices}};
  avatar.topology.triangle_uvs = {{0, 1, 2}};
  if (architecture.identity == IdentityConditioning::kLearned) {
    const int64_t people = architecture.identities, size_each = architecture.identity_size;
    avatar.weights[kIdentityVectors] = {{people, size_each}, values(people * size_each, 0, 1)};
  }
  const int named = NamedChannels(architecture);
  avatar.condition_mean = values(named, 0, 1);
  avatar.condition_deviation.assign(named, 0.5f);
  for (int i = 0; i < 3; ++i) {
    avatar.codes.push_back({"random", std::to_string(i), values(architecture.latent, 0, 1), 0, values(named, 0, 1)});
  }
  return avatar;
}

}  // namespace likeness
