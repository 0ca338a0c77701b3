#include "likeness/avatar/tensor_registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace likeness {
namespace {

using testing::ElementsAre;

Architecture Paper(int size) {
  Architecture a;
  a.texture_size = size;
  a.vertex_count = 7306;
  return a;
}

const TensorInfo& Find(const std::vector<TensorInfo>& tensors, const std::string& name) {
  for (const TensorInfo& tensor : tensors) {
    if (tensor.name == name) return tensor;
  }
  static const TensorInfo none;
  ADD_FAILURE() << "no tensor " << name;
  return none;
}

TEST(TensorRegistry, PaperPresetHasTheParametersCountedByHand) {
  // Kernels of the encoder, 16 taps; the decoder's are the same in reverse.
  const int64_t kernels = 16 * (3 * 16 + 16 * 32 + 32 * 32 + 32 * 64 + 64 * 64 + 64 * 128 + 128 * 128 + 128 * 256);
  const int64_t encoder_biases = 512 * 512 * 16 + 256 * 256 * 32 + 128 * 128 * 32 + 64 * 64 * 64 + 32 * 32 * 64 +
                                 16 * 16 * 128 + 8 * 8 * 128 + 4 * 4 * 256;
  const int64_t decoder_biases = 8 * 8 * 128 + 16 * 16 * 128 + 32 * 32 * 64 + 64 * 64 * 64 + 128 * 128 * 32 +
                                 256 * 256 * 32 + 512 * 512 * 16 + 1024 * 1024 * 3;
  const int64_t encoder_fc = (4096 * 256 + 256) + (21918 * 256 + 256) + 2 * (512 * 128 + 128);
  const int64_t decoder_fc = (128 * 256 + 256) + (256 * 21918 + 21918) + (3 * 8 + 8) + (264 * 4096 + 4096);
  EXPECT_EQ(kernels, 1'041'152);
  EXPECT_EQ(encoder_biases, 7'188'480);
  EXPECT_EQ(decoder_biases, 10'330'112);
  EXPECT_EQ(ParameterCount(Paper(1024)), 2 * kernels + encoder_biases + decoder_biases + encoder_fc + decoder_fc);
}

TEST(TensorRegistry, OptionsChangeOnlyTheirTensors) {
  const int64_t all = ParameterCount(Paper(1024));
  Architecture a = Paper(1024);
  a.untied_bias = UntiedBias::kDecoder;
  EXPECT_EQ(ParameterCount(a), all - 7'188'480 + (16 + 32 + 32 + 64 + 64 + 128 + 128 + 256));
  a.untied_bias = UntiedBias::kNone;
  EXPECT_EQ(ParameterCount(a), all - 7'188'480 - 10'330'112 + (16 + 32 + 32 + 64 + 64 + 128 + 128 + 256) +
                                   (128 + 128 + 64 + 64 + 32 + 32 + 16 + 3));
  a = Paper(1024);
  a.conditioning = Conditioning::kFc32;
  EXPECT_EQ(ParameterCount(a), all + 24 * (3 + 1) + 24 * 4096);
  a.conditioning = Conditioning::kRaw;
  EXPECT_EQ(ParameterCount(a), all - (3 * 8 + 8) - 5 * 4096);
  // Three values to each of the eight convolutions' inputs, in place of eight beside the code.
  a.conditioning = Conditioning::kRawAll;
  EXPECT_EQ(ParameterCount(a), all - (3 * 8 + 8) - 8 * 4096 + (3 + 1) * (256 + 128 + 128 + 64 + 64 + 32 + 32 + 16));
  a.conditioning = Conditioning::kFc8All;
  EXPECT_EQ(ParameterCount(a), all - 8 * 4096 + (8 + 1) * (256 + 128 + 128 + 64 + 64 + 32 + 32 + 16));
  a = Paper(1024);
  a.residual = true;
  // Kernels 3 x 3 and biases after 16-32-32-64-64-128-128-256 and 128-128-64-64-32-32-16-3 channels.
  EXPECT_EQ(ParameterCount(a), all + 2 * 9 * (16 * 16 + 2 * (32 * 32 + 64 * 64 + 128 * 128)) + 9 * (256 * 256 + 3 * 3) +
                                   2 * (16 + 2 * (32 + 64 + 128)) + 256 + 3);
  a = Paper(1024);
  a.normalisation = Normalisation::kNone;  // folded weights have the same shapes
  EXPECT_EQ(ParameterCount(a), all);
}

// The condition vector's columns: beside the code in the decoder's first layer, beside the sub-encodings in the
// encoder's last ones; in linear models beside the code, and beside the mesh.
TEST(TensorRegistry, ConditionsWidenTheLayersThatReadThem) {
  const auto told = [](Architecture a, IdentityConditioning identity) {
    a.identities = 4;
    a.identity = identity;
    a.identity_size = identity == IdentityConditioning::kLearned ? 16 : 0;
    a.conditions = {{"gaze", 6}, {"light", 1}};
    return a;
  };
  const Architecture paper = Paper(1024);
  const int64_t all = ParameterCount(paper);
  EXPECT_EQ(ParameterCount(told(paper, IdentityConditioning::kNone)), all + 7 * (256 + 2 * 128));
  EXPECT_EQ(ParameterCount(told(paper, IdentityConditioning::kOneHot)), all + (4 + 7) * (256 + 2 * 128));
  EXPECT_EQ(ParameterCount(told(paper, IdentityConditioning::kLearned)), all + (16 + 7) * (256 + 2 * 128) + 4 * 16);
  Architecture multiface = paper;
  multiface.layout = Layout::kMultiface;
  multiface.latent = 256;
  EXPECT_EQ(ParameterCount(told(multiface, IdentityConditioning::kOneHot)),
            ParameterCount(multiface) + (4 + 7) * (256 + 512));
  Architecture linear = Paper(512);
  linear.model = ModelKind::kLinear;
  const int64_t texture = 3 * 512 * 512, mesh = 21918;
  EXPECT_EQ(ParameterCount(told(linear, IdentityConditioning::kOneHot)),
            ParameterCount(linear) + (4 + 7) * (128 + mesh + texture));
  linear.model = ModelKind::kBilinear;
  EXPECT_EQ(ParameterCount(told(linear, IdentityConditioning::kOneHot)),
            ParameterCount(linear) + (4 + 7) * (128 + mesh + 3 * texture));
}

TEST(TensorRegistry, ShapesAtHalfTheSize) {
  const std::vector<TensorInfo> tensors = NetworkTensors(Paper(512));
  EXPECT_THAT(Find(tensors, "encoder.texture_conv.0.weight").shape, ElementsAre(16, 3, 4, 4));
  EXPECT_THAT(Find(tensors, "encoder.texture_conv.0.bias").shape, ElementsAre(16, 256, 256));
  EXPECT_THAT(Find(tensors, "encoder.texture_conv.6.bias").shape, ElementsAre(128, 4, 4));
  EXPECT_THAT(Find(tensors, "encoder.texture_fc.weight").shape, ElementsAre(256, 2048));
  EXPECT_THAT(Find(tensors, "decoder.texture_fc.weight").shape, ElementsAre(2048, 264));
  EXPECT_THAT(Find(tensors, "decoder.texture_conv.0.weight").shape, ElementsAre(128, 128, 4, 4));
  EXPECT_THAT(Find(tensors, "decoder.texture_conv.6.weight").shape, ElementsAre(16, 3, 4, 4));
  EXPECT_THAT(Find(tensors, "decoder.texture_conv.6.bias").shape, ElementsAre(3, 512, 512));
}

// The paper's table: (21918 + 3 x 512^2) x 128 weights each way; the bilinear decoder has three times the texture's.
TEST(TensorRegistry, LinearModelsHaveThePapersSize) {
  Architecture a = Paper(512);
  a.model = ModelKind::kLinear;
  const int64_t outputs = 21918 + 3 * 512 * 512, biases = 128 + 128 + 128 + outputs;
  EXPECT_EQ(ParameterCount(a), 2 * outputs * 128 + biases);
  a.model = ModelKind::kBilinear;
  EXPECT_EQ(ParameterCount(a), 2 * outputs * 128 + biases + 2 * 3 * 512 * 512 * 128);
}

TEST(TensorRegistry, MultifaceShapesAtHalfTheSize) {
  Architecture a = Paper(512);
  a.layout = Layout::kMultiface;
  a.latent = 256;
  a.untied_bias = UntiedBias::kDecoderAndChannel;
  const std::vector<TensorInfo> tensors = NetworkTensors(a);
  EXPECT_THAT(Find(tensors, "encoder.texture_conv.7.bias").shape, ElementsAre(128));
  EXPECT_THAT(Find(tensors, "encoder.texture_fc.weight").shape, ElementsAre(256, 512));
  EXPECT_THAT(Find(tensors, "encoder.code_fc.weight").shape, ElementsAre(512, 512));
  EXPECT_THAT(Find(tensors, "decoder.texture_fc.weight").shape, ElementsAre(1024, 264));
  EXPECT_THAT(Find(tensors, "decoder.texture_conv.0.bias").shape, ElementsAre(256, 4, 4));
  EXPECT_THAT(Find(tensors, "decoder.texture_conv.7.bias").shape, ElementsAre(3, 512, 512));
  a.upsampling = Upsampling::kNearest;
  EXPECT_THAT(Find(NetworkTensors(a), "decoder.texture_conv.1.weight").shape, ElementsAre(64, 256, 3, 3));
}

TEST(TensorRegistry, NamesAreUniqueAndChannelsConnect) {
  for (const int size : {16, 64, 512, 1024, 4096}) {
    std::set<std::string> names;
    for (const TensorInfo& tensor : NetworkTensors(Paper(size))) {
      EXPECT_TRUE(names.insert(tensor.name).second) << tensor.name;
      EXPECT_FALSE(tensor.meaning.empty()) << tensor.name;
    }
    int channels = 3;
    for (const LayerInfo& layer : Layers(Paper(size))) {
      if (layer.kind == LayerKind::kConvolution) {
        EXPECT_EQ(layer.in, channels) << layer.name;
        channels = layer.out;
      }
      if (layer.kind == LayerKind::kTransposedConvolution) {
        EXPECT_EQ(layer.in, channels) << layer.name;
        channels = layer.out;
      }
    }
    EXPECT_EQ(channels, 3);
  }
}

}  // namespace
}  // namespace likeness
