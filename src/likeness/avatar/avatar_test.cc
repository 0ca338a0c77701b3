#include "likeness/avatar/avatar.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "likeness/avatar/safetensors.h"
#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/file.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::HasSubstr;

Avatar SmallAvatar() {
  Avatar avatar;
  avatar.architecture.texture_size = 16;
  avatar.architecture.vertex_count = 4;
  avatar.architecture.latent = 3;
  avatar.topology.vertex_count = 4;
  avatar.topology.uvs = {{0, 0}, {1, 0}, {0, 1}, {1, 1}, {0.5f, 0.25f}};
  avatar.topology.triangles = {{0, 1, 2}, {2, 1, 3}};
  avatar.topology.triangle_uvs = {{0, 1, 2}, {2, 4, 3}};
  Random random(7);
  const auto value = [&] { return static_cast<float>(random.Normal()); };
  avatar.texture_mean = ImageF(16, 16, 3);
  for (float& v : avatar.texture_mean.values()) v = 100 + value();
  avatar.texture_variance = 512.125;
  avatar.vertex_mean = Vertices(4, 3);
  for (int i = 0; i < 12; ++i) avatar.vertex_mean.data()[i] = value();
  avatar.vertex_variance = 1.0 / 3;
  for (const TensorInfo& info : NetworkTensors(avatar.architecture)) {
    Tensor& tensor = avatar.weights[info.name];
    tensor.shape = info.shape;
    tensor.values.resize(ElementCount(info.shape));
    for (float& v : tensor.values) v = value();
  }
  avatar.codes = {{"EXP_jaw", "000003", {1, 2, 3}}, {"SEN", "7", {4, 5, 6}}};
  avatar.training = {{"iterations", "12"}, {"seed", "1"}};
  return avatar;
}

void ExpectEqual(const Avatar& a, const Avatar& b) {
  EXPECT_EQ(a.architecture, b.architecture);
  EXPECT_EQ(a.topology.vertex_count, b.topology.vertex_count);
  EXPECT_EQ(a.topology.uvs, b.topology.uvs);
  EXPECT_EQ(a.topology.triangles, b.topology.triangles);
  EXPECT_EQ(a.topology.triangle_uvs, b.topology.triangle_uvs);
  EXPECT_EQ(a.texture_mean, b.texture_mean);
  EXPECT_EQ(a.texture_variance, b.texture_variance);
  EXPECT_EQ(a.vertex_mean, b.vertex_mean);
  EXPECT_EQ(a.vertex_variance, b.vertex_variance);
  ASSERT_EQ(a.weights.size(), b.weights.size());
  for (const auto& [name, tensor] : a.weights) {
    EXPECT_EQ(tensor.shape, b.weights.at(name).shape) << name;
    EXPECT_EQ(tensor.values, b.weights.at(name).values) << name;
  }
  ASSERT_EQ(a.codes.size(), b.codes.size());
  for (size_t i = 0; i < a.codes.size(); ++i) {
    EXPECT_EQ(a.codes[i].segment, b.codes[i].segment);
    EXPECT_EQ(a.codes[i].frame, b.codes[i].frame);
    EXPECT_EQ(a.codes[i].mu, b.codes[i].mu);
  }
  EXPECT_EQ(a.training, b.training);
}

TEST(Avatar, RoundTripIsExact) {
  const ScratchFolder folder;
  const Avatar avatar = SmallAvatar();
  SaveAvatar(folder / "a.safetensors", avatar);
  ExpectEqual(LoadAvatar(folder / "a.safetensors"), avatar);
}

TEST(Avatar, SaveRefusesWhatIsIncomplete) {
  const ScratchFolder folder;
  const auto error = [&](auto change) {
    Avatar avatar = SmallAvatar();
    change(avatar);
    return ErrorOf([&] { SaveAvatar(folder / "a.safetensors", avatar); });
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(error([](Avatar& a) { a.weights.erase("decoder.view_fc.bias"); }), HasSubstr("'decoder.view_fc.bias'"));
  EXPECT_THAT(error([](Avatar& a) { a.weights["more"]; }), HasSubstr("this architecture has"));
  EXPECT_THAT(error([](Avatar& a) { a.weights["decoder.view_fc.bias"].shape = {9}; }), HasSubstr("expected [8]"));
  EXPECT_THAT(error([&](Avatar& a) { a.weights["decoder.view_fc.bias"].values[2] = nan; }), HasSubstr("not finite"));
  EXPECT_THAT(error([&](Avatar& a) { a.texture_mean.at(0, 0)[0] = nan; }), HasSubstr("not finite"));
  EXPECT_THAT(error([](Avatar& a) { a.texture_mean = ImageF(8, 16, 3); }), HasSubstr("mean texture is 8 x 16"));
  EXPECT_THAT(error([](Avatar& a) { a.texture_variance = 0; }), HasSubstr("texture variance"));
  EXPECT_THAT(error([&](Avatar& a) { a.vertex_variance = nan; }), HasSubstr("vertex variance"));
  EXPECT_THAT(error([](Avatar& a) { a.vertex_mean = Vertices::Zero(5, 3); }), HasSubstr("vertices"));
  EXPECT_THAT(error([](Avatar& a) { a.topology.triangles[0][0] = 4; }), HasSubstr("a.safetensors"));
  EXPECT_THAT(error([](Avatar& a) { a.codes[0].mu.pop_back(); }), HasSubstr("code of EXP_jaw 000003"));
  EXPECT_THAT(error([](Avatar& a) { a.architecture.model = ModelKind::kLinear; }), HasSubstr("not available yet"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.safetensors"));
}

// Each case changes one entry of a good file.
TEST(Avatar, LoadRefusesWhatDoesNotFit) {
  const ScratchFolder folder;
  SaveAvatar(folder / "a.safetensors", SmallAvatar());
  const SafetensorsFile good(folder / "a.safetensors");
  const auto error = [&](const std::map<std::string, std::string>& metadata, const std::string& dropped = "") {
    std::vector<TensorView> tensors;
    for (const std::string& name : good.names()) {
      if (name != dropped) tensors.push_back({name, good.DTypeOf(name), good.ShapeOf(name), good.Bytes(name)});
    }
    WriteSafetensors(folder / "b.safetensors", tensors, metadata);
    return ErrorOf([&] { LoadAvatar(folder / "b.safetensors"); });
  };
  const auto with = [&](const std::string& key, const std::string& value) {
    std::map<std::string, std::string> metadata = good.metadata();
    metadata[key] = value;
    return error(metadata);
  };
  ASSERT_EQ(error(good.metadata()), "");
  EXPECT_THAT(error({}), HasSubstr("is no avatar"));
  EXPECT_THAT(with("format", "pt"), HasSubstr("is no avatar"));
  EXPECT_THAT(with("version", "99"), HasSubstr("version '99'"));
  EXPECT_EQ(with("version", "1"), "");
  EXPECT_THAT(with("architecture", "{}"), HasSubstr("architecture is not understood"));
  EXPECT_THAT(with("texture.variance", "-1"), HasSubstr("texture variance is -1"));
  EXPECT_THAT(with("texture.variance", "nan"), HasSubstr("texture variance is nan"));
  EXPECT_THAT(with("vertex.variance", "1x"), HasSubstr("no number"));
  EXPECT_THAT(with("vertex.variance", ""), HasSubstr("no number"));
  EXPECT_THAT(with("codes.frames", "[[\"a\",\"b\"]]"), HasSubstr("codes.mu"));
  EXPECT_THAT(with("codes.frames", "7"), HasSubstr("not understood"));
  EXPECT_THAT(with("training", "[[["), HasSubstr("not understood"));
  Architecture other = SmallAvatar().architecture;
  other.latent = 4;
  EXPECT_THAT(with("architecture", ArchitectureToJson(other)), HasSubstr("encoder.mu_fc.weight"));
  other = SmallAvatar().architecture;
  other.texture_size = 4096;
  EXPECT_THAT(with("architecture", ArchitectureToJson(other)), HasSubstr("encoder.texture_conv.0.bias"));
  for (const char* name : {"topology.uvs", "texture.mean", "vertex.mean", "codes.mu", "decoder.code_fc.weight"}) {
    EXPECT_THAT(error(good.metadata(), name), HasSubstr(name));
  }
}

}  // namespace
}  // namespace likeness
