#include "likeness/avatar/multiface/import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::HasSubstr;
using Checkpoint = std::map<std::string, Tensor>;

constexpr int kLatent = 4, kVertices = 5, kSize = 512;

void Add(Checkpoint& checkpoint, const std::string& name, const std::vector<int64_t>& shape) {
  static Random random(11);
  Tensor tensor{shape, std::vector<float>(ElementCount(shape))};
  for (float& value : tensor.values) value = static_cast<float>(random.Normal());
  checkpoint["module." + name] = tensor;
}

// With the keys and shapes of the published list, smaller.
Checkpoint SmallCheckpoint() {
  Checkpoint c;
  const auto layer = [&](const std::string& name, std::vector<int64_t> shape, int64_t out) {
    Add(c, name + ".weight", shape);
    Add(c, name + ".bias", {out});
    Add(c, name + ".g", {out});
  };
  const int encoder[] = {3, 16, 16, 32, 32, 64, 64, 128, 128};
  const int decoder[] = {kLatent, kLatent, 64, 64, 32, 32, 16, 16, 3};
  for (int i = 0; i < 8; ++i) {
    const std::string number = std::to_string(i / 2) + ".conv" + std::to_string(i % 2 + 1);
    layer("enc.texture_encoder.downsample." + number, {encoder[i + 1], encoder[i], 4, 4}, encoder[i + 1]);
    const std::string block = "dec.texture_decoder.upsample." + number;
    layer(block + ".deconv", {decoder[i], decoder[i + 1], 4, 4}, decoder[i + 1]);
    Add(c, block + ".bias", {1, decoder[i + 1], 4 << i, 4 << i});
  }
  layer("enc.texture_fc", {256, 128 * 4}, 256);
  layer("enc.mesh_fc", {256, 3 * kVertices}, 256);
  layer("enc.fc", {2 * kLatent, 512}, 2 * kLatent);
  layer("dec.view_fc", {8, 3}, 8);
  layer("dec.z_fc", {256, kLatent}, 256);
  layer("dec.mesh_fc", {3 * kVertices, 256}, 3 * kVertices);
  layer("dec.texture_fc", {kLatent * 4, 264}, kLatent * 4);
  for (const char* name : {"cc.weight", "cc.bias"}) Add(c, name, {6, 3, 1, 1});
  for (const char* name : {"cc.weight_anchor", "cc.bias_anchor"}) Add(c, name, {1, 3, 1, 1});
  return c;
}

TEST(ImportMultiface, FindsSizesAndFillsEveryTensor) {
  const MultifaceNetwork network = ImportMultiface("a.pth", SmallCheckpoint());
  EXPECT_EQ(network.architecture.latent, kLatent);
  EXPECT_EQ(network.architecture.vertex_count, kVertices);
  EXPECT_EQ(network.architecture.texture_size, kSize);
  EXPECT_EQ(network.architecture.untied_bias, UntiedBias::kDecoderAndChannel);
  EXPECT_FALSE(network.architecture.residual);
  EXPECT_EQ(network.cameras, 7);
  const std::vector<TensorInfo> infos = NetworkTensors(network.architecture);
  EXPECT_EQ(network.weights.size(), infos.size());
  for (const TensorInfo& info : infos) EXPECT_EQ(network.weights.at(info.name).shape, info.shape) << info.name;
}

TEST(ImportMultiface, FoldsAndTurnsRowsRound) {
  const Checkpoint c = SmallCheckpoint();
  const MultifaceNetwork network = ImportMultiface("a.pth", c);
  const auto norm = [](const Tensor& tensor) {
    double squares = 0;
    for (const float w : tensor.values) squares += static_cast<double>(w) * w;
    return std::sqrt(squares);
  };
  const std::string block = "module.dec.texture_decoder.upsample.1.conv1";
  const Tensor &weight = c.at(block + ".deconv.weight"), &gain = c.at(block + ".deconv.g");
  const Tensor &channel = c.at(block + ".deconv.bias"), &texel = c.at(block + ".bias");
  const Tensor &ours = network.weights.at("decoder.texture_conv.2.weight"),
               &bias = network.weights.at("decoder.texture_conv.2.bias");
  for (int i = 0; i < 64 * 64; i += 7) {
    for (int tap = 0; tap < 16; ++tap) {
      const int y = tap / 4, x = tap % 4;
      EXPECT_NEAR(ours.values[i * 16 + (3 - y) * 4 + x],
                  weight.values[i * 16 + tap] * gain.values[i % 64] / norm(weight), 1e-6);
    }
  }
  for (int i = 0; i < 64 * 16 * 16; i += 5) {
    const int o = i / 256, y = i / 16 % 16, x = i % 16;
    EXPECT_EQ(bias.values[(o * 16 + 15 - y) * 16 + x], channel.values[o] + texel.values[i]);
  }
  // The inner features have two rows.
  const Tensor &fc = c.at("module.dec.texture_fc.bias"), &our_fc = network.weights.at("decoder.texture_fc.bias");
  for (int i = 0; i < kLatent * 4; ++i) EXPECT_EQ(our_fc.values[i ^ 2], fc.values[i]);
}

TEST(ImportMultiface, UnderstandsOtherSpellings) {
  Checkpoint c;
  for (const auto& [name, tensor] : SmallCheckpoint()) {
    const std::string plain = name.substr(std::string("module.").size());
    const bool of_deconv = plain.ends_with(".deconv.bias"), of_colours = plain.starts_with("cc.");
    if (!of_deconv && !of_colours) c[plain] = tensor;
    if (plain.starts_with("dec.texture_decoder") && !of_deconv && plain.ends_with(".bias")) {
      c[plain] = {{1, tensor.shape[1], 1, 1}, std::vector<float>(tensor.shape[1], 0.5f)};
    }
  }
  const MultifaceNetwork network = ImportMultiface("a.pth", c);
  EXPECT_EQ(network.architecture.untied_bias, UntiedBias::kNone);
  EXPECT_EQ(network.cameras, 0);
  EXPECT_EQ(network.weights.at("decoder.texture_conv.7.bias").values, std::vector<float>(3, 0.5f));
}

TEST(ImportMultiface, SaysWhatDoesNotFit) {
  const auto error = [](auto change) {
    Checkpoint c = SmallCheckpoint();
    change(c);
    return ErrorOf([&] { ImportMultiface("a.pth", c); });
  };
  EXPECT_EQ(error([](Checkpoint&) {}), "");
  EXPECT_THAT(error([](Checkpoint& c) { c.clear(); }), HasSubstr("holds no tensors"));
  EXPECT_THAT(error([](Checkpoint& c) { c.erase("module.dec.z_fc.weight"); }), HasSubstr("a.pth: lacks the tensor"));
  EXPECT_THAT(error([](Checkpoint& c) { c.erase("module.enc.fc.g"); }), HasSubstr("'enc.fc.g'"));
  EXPECT_THAT(error([](Checkpoint& c) { Add(c, "warp.mlp.0.weight", {3}); }), HasSubstr("'module.warp.mlp.0.weight'"));
  EXPECT_THAT(error([](Checkpoint& c) { Add(c, "dec.texture_fc.weight", {kLatent * 5, 264}); }), HasSubstr("features"));
  EXPECT_THAT(error([](Checkpoint& c) { Add(c, "dec.z_fc.weight", {256}); }), HasSubstr("1 axes"));
  EXPECT_THAT(error([](Checkpoint& c) { Add(c, "dec.z_fc.weight", {256, 0}); }), HasSubstr("codes of 0"));
  EXPECT_THAT(error([](Checkpoint& c) { Add(c, "enc.fc.bias", {9}); }), HasSubstr("is [9]; expected [8]"));
  EXPECT_THAT(error([](Checkpoint& c) { Add(c, "cc.bias", {5, 3, 1, 1}); }), HasSubstr("'cc.bias'"));
  EXPECT_THAT(error([](Checkpoint& c) {
                Tensor& weight = c.at("module.dec.view_fc.weight");
                std::fill(weight.values.begin(), weight.values.end(), 0.0f);
              }),
              HasSubstr("zero everywhere"));
}

}  // namespace
}  // namespace likeness
