// A small avatar with a known law, for tests: the procedural head, bilinear in code and view.

#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "likeness/avatar/avatar.h"
#include "likeness/avatar/tensor_registry.h"
#include "likeness/image/resize.h"
#include "likeness/simulate/procedural_head.h"

namespace likeness {

// A unit of the code's first value opens the jaw, of the second smiles, of the third puffs the cheeks. The fourth is 1
// in every frame, and brings in the view: red grows by kRedForX times the view's x, all over the texture.
inline constexpr float kRedForX = 60;

inline Avatar MakeTestAvatar(int texture_size = 128) {
  ProceduralOptions head_options;
  head_options.plain = true;
  head_options.texture_size = texture_size;
  head_options.detail = 1;
  const std::unique_ptr<Head> head = MakeProceduralHead(head_options);
  const auto pose = [&](const std::vector<std::string>& expressions) {
    std::array<float, kExpressionCount> weights = {};
    for (const std::string& name : expressions) weights[static_cast<size_t>(ExpressionIndex(name))] = 1;
    return head->Pose(weights).tracked;
  };
  Avatar avatar;
  Architecture& a = avatar.architecture;
  a.preset = "bilinear";
  a.model = ModelKind::kBilinear;
  a.texture_size = texture_size;
  a.latent = 4;
  avatar.topology = head->tracked_topology();
  a.vertex_count = avatar.topology.vertex_count;
  avatar.identities[0].vertex_mean = pose({});
  avatar.identities[0].texture_mean = ToFloat(head->surfaces()[0].material.albedo);
  for (const TensorInfo& tensor : NetworkTensors(a)) {
    avatar.weights[tensor.name] = {tensor.shape, std::vector<float>(static_cast<size_t>(ElementCount(tensor.shape)))};
  }
  const std::array<Vertices, 3> shapes = {pose({"jawOpen"}), pose({"mouthSmileLeft", "mouthSmileRight"}),
                                          pose({"cheekPuff"})};
  std::vector<float>& mesh = avatar.weights["decoder.mesh_fc.weight"].values;  // [3 V, 4]
  for (size_t k = 0; k < shapes.size(); ++k) {
    const Vertices moved = shapes[k] - avatar.identities[0].vertex_mean;
    for (size_t i = 0; i < static_cast<size_t>(moved.size()); ++i) mesh[4 * i + k] = moved.data()[i];
  }
  std::vector<float>& texture = avatar.weights["decoder.texture_fc.weight"].values;  // [3 S S, x, y, z times 4]
  for (size_t texel = 0; texel < texture.size() / 12; texel += 3) texture[12 * texel + 3] = kRedForX;
  const auto add = [&](const std::string& segment, const std::string& frame, const std::array<float, 3>& code) {
    avatar.codes.push_back({segment, frame, {code[0], code[1], code[2], 1}});
  };
  add("jaw", "001", {0, 0, 0});
  add("jaw", "002", {0.5f, 0, 0});
  add("jaw", "003", {1, 0, 0});
  add("smile", "001", {0, 0.6f, 0});
  add("smile", "002", {0, 1, 0});
  add("cheeks", "001", {0, 0, 1});
  return avatar;
}

}  // namespace likeness
