#include "likeness/avatar/avatar.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "likeness/avatar/avatar_id.h"
#include "likeness/avatar/safetensors.h"
#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/file.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::HasSubstr;

void FillWeights(Avatar* avatar) {
  Random random(8);
  for (const TensorInfo& info : NetworkTensors(avatar->architecture)) {
    Tensor& tensor = avatar->weights[info.name];
    tensor.shape = info.shape;
    tensor.values.resize(ElementCount(info.shape));
    for (float& v : tensor.values) v = static_cast<float>(random.Normal());
  }
}

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
  avatar.identities[0].texture_mean = ImageF(16, 16, 3);
  for (float& v : avatar.identities[0].texture_mean.values()) v = 100 + value();
  avatar.texture_variance = 512.125;
  avatar.identities[0].vertex_mean = Vertices(4, 3);
  for (int i = 0; i < 12; ++i) avatar.identities[0].vertex_mean.data()[i] = value();
  avatar.vertex_variance = 1.0 / 3;
  FillWeights(&avatar);
  avatar.codes = {{"EXP_jaw", "000003", {1, 2, 3}}, {"SEN", "7", {4, 5, 6}}};
  avatar.training = {{"iterations", "12"}, {"seed", "1"}};
  return avatar;
}

// Two people with learned vectors, and frames with gaze and light.
Avatar SmallFamily() {
  Avatar avatar = SmallAvatar();
  avatar.architecture.identities = 2;
  avatar.architecture.identity = IdentityConditioning::kLearned;
  avatar.architecture.identity_size = 5;
  avatar.architecture.conditions = {{"gaze", 2}, {"light", 1}};
  avatar.identities.push_back(avatar.identities[0]);
  avatar.identities[0].name = "anna";
  avatar.identities[1].name = "ben";
  avatar.identities[1].texture_mean.at(3, 4)[1] = 7;
  avatar.identities[1].vertex_mean(2, 1) = -8;
  avatar.condition_mean = {0.5f, -1, 3};
  avatar.condition_deviation = {2, 2, 0.25f};
  avatar.codes[0].conditions = {1, 2, 3};
  avatar.codes[1].conditions = {4, 5, 6};
  avatar.codes[1].identity = 1;
  FillWeights(&avatar);
  return avatar;
}

void ExpectEqual(const Avatar& a, const Avatar& b) {
  EXPECT_EQ(a.architecture, b.architecture);
  EXPECT_EQ(a.topology.vertex_count, b.topology.vertex_count);
  EXPECT_EQ(a.topology.uvs, b.topology.uvs);
  EXPECT_EQ(a.topology.triangles, b.topology.triangles);
  EXPECT_EQ(a.topology.triangle_uvs, b.topology.triangle_uvs);
  ASSERT_EQ(a.identities.size(), b.identities.size());
  for (size_t i = 0; i < a.identities.size(); ++i) {
    EXPECT_EQ(a.identities[i].name, b.identities[i].name);
    EXPECT_EQ(a.identities[i].texture_mean, b.identities[i].texture_mean);
    EXPECT_EQ(a.identities[i].vertex_mean, b.identities[i].vertex_mean);
  }
  EXPECT_EQ(a.texture_variance, b.texture_variance);
  EXPECT_EQ(a.vertex_variance, b.vertex_variance);
  EXPECT_EQ(a.condition_mean, b.condition_mean);
  EXPECT_EQ(a.condition_deviation, b.condition_deviation);
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
    EXPECT_EQ(a.codes[i].identity, b.codes[i].identity);
    EXPECT_EQ(a.codes[i].conditions, b.codes[i].conditions);
  }
  EXPECT_EQ(a.training, b.training);
}

TEST(Avatar, RoundTripIsExact) {
  const ScratchFolder folder;
  const Avatar avatar = SmallAvatar();
  SaveAvatar(folder / "a.safetensors", avatar);
  ExpectEqual(LoadAvatar(folder / "a.safetensors"), avatar);
}

TEST(Avatar, IsKnownByItsDecoder) {
  const ScratchFolder folder;
  Avatar avatar = SmallAvatar();
  const std::string id = AvatarId(avatar);
  EXPECT_EQ(id.size(), 16);
  avatar.codes.clear();
  avatar.identities[0].name = "anna";
  SaveAvatar(folder / "a.safetensors", avatar);
  EXPECT_EQ(AvatarId(SafetensorsFile(folder / "a.safetensors")), id);
  avatar.weights["decoder.mesh_fc.bias"].values[5] += 1e-3f;
  EXPECT_NE(AvatarId(avatar), id);
}

TEST(Avatar, PeopleAndConditionsRoundTrip) {
  const ScratchFolder folder;
  const Avatar avatar = SmallFamily();
  SaveAvatar(folder / "a.safetensors", avatar);
  ExpectEqual(LoadAvatar(folder / "a.safetensors"), avatar);
  const SafetensorsFile file(folder / "a.safetensors");
  EXPECT_THAT(file.ShapeOf("texture.mean"), testing::ElementsAre(2, 16, 16, 3));
  EXPECT_THAT(file.ShapeOf("vertex.mean"), testing::ElementsAre(2, 4, 3));
  EXPECT_THAT(file.ShapeOf("identity.vectors"), testing::ElementsAre(2, 5));
  EXPECT_THAT(file.ShapeOf("codes.conditions"), testing::ElementsAre(2, 3));
}

TEST(Avatar, CheckRefusesPeopleAndConditionsThatDoNotFit) {
  const auto error = [&](auto change) {
    Avatar avatar = SmallFamily();
    change(avatar);
    return ErrorOf([&] { avatar.Check("a"); });
  };
  EXPECT_EQ(error([](Avatar&) {}), "");
  EXPECT_THAT(error([](Avatar& a) { a.identities.pop_back(); }), HasSubstr("2 people, there are 1"));
  EXPECT_THAT(error([](Avatar& a) { a.identities[1].name = "anna"; }), HasSubstr("name is 'anna'"));
  EXPECT_THAT(error([](Avatar& a) { a.identities[1].name = ""; }), HasSubstr("name is ''"));
  EXPECT_THAT(error([](Avatar& a) { a.identities[1].texture_mean = ImageF(8, 8, 3); }), HasSubstr("8 x 8"));
  EXPECT_THAT(error([](Avatar& a) { a.condition_mean.pop_back(); }), HasSubstr("not 3 numbers"));
  EXPECT_THAT(error([](Avatar& a) { a.condition_deviation[1] = 0; }), HasSubstr("positive"));
  EXPECT_THAT(error([](Avatar& a) { a.codes[0].conditions.clear(); }), HasSubstr("conditions of EXP_jaw"));
  EXPECT_THAT(error([](Avatar& a) { a.codes[0].identity = 2; }), HasSubstr("person 2 of 2"));
  EXPECT_THAT(error([](Avatar& a) { a.weights.erase("identity.vectors"); }), HasSubstr("'identity.vectors'"));
}

// A file as version 2 wrote it: no names of people, no conditions, an architecture that knows of neither.
TEST(Avatar, FilesOfVersionTwoAreOfOnePerson) {
  const ScratchFolder folder;
  const Avatar avatar = SmallAvatar();
  SaveAvatar(folder / "a.safetensors", avatar);
  const SafetensorsFile now(folder / "a.safetensors");
  std::vector<TensorView> tensors;
  for (const std::string& name : now.names()) {
    tensors.push_back({name, now.DTypeOf(name), now.ShapeOf(name), now.Bytes(name)});
  }
  std::map<std::string, std::string> metadata = now.metadata();
  metadata["version"] = "2";
  EXPECT_EQ(metadata.erase("identities"), 1u);
  std::string& architecture = metadata["architecture"];
  const std::string added = R"(,"identity":"none","identity_size":0,"conditions":[])";
  ASSERT_NE(architecture.find(added), std::string::npos) << architecture;
  architecture.replace(architecture.find(added), added.size(), "");
  WriteSafetensors(folder / "old.safetensors", tensors, metadata);
  ExpectEqual(LoadAvatar(folder / "old.safetensors"), avatar);
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
  EXPECT_THAT(error([&](Avatar& a) { a.identities[0].texture_mean.at(0, 0)[0] = nan; }), HasSubstr("not finite"));
  EXPECT_THAT(error([](Avatar& a) { a.identities[0].texture_mean = ImageF(8, 16, 3); }),
              HasSubstr("mean texture is 8 x 16"));
  EXPECT_THAT(error([](Avatar& a) { a.texture_variance = 0; }), HasSubstr("texture variance"));
  EXPECT_THAT(error([&](Avatar& a) { a.vertex_variance = nan; }), HasSubstr("vertex variance"));
  EXPECT_THAT(error([](Avatar& a) { a.identities[0].vertex_mean = Vertices::Zero(5, 3); }), HasSubstr("vertices"));
  EXPECT_THAT(error([](Avatar& a) { a.topology.triangles[0][0] = 4; }), HasSubstr("a.safetensors"));
  EXPECT_THAT(error([](Avatar& a) { a.codes[0].mu.pop_back(); }), HasSubstr("code of EXP_jaw 000003"));
  EXPECT_THAT(error([](Avatar& a) { a.architecture.model = ModelKind::kLinear; }), HasSubstr("encoder.texture_fc"));
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
  EXPECT_EQ(with("version", "2"), "");
  EXPECT_THAT(with("identities", "[\"a\",\"b\"]"), HasSubstr("names 2 people"));
  EXPECT_THAT(with("identities", "7"), HasSubstr("not understood"));
  EXPECT_THAT(with("architecture", "{}"), HasSubstr("architecture is not understood"));
  EXPECT_THAT(with("texture.variance", "-1"), HasSubstr("texture variance is -1"));
  EXPECT_THAT(with("texture.variance", "nan"), HasSubstr("texture variance is nan"));
  EXPECT_THAT(with("vertex.variance", "1x"), HasSubstr("no number"));
  EXPECT_THAT(with("vertex.variance", ""), HasSubstr("no number"));
  EXPECT_THAT(with("codes.frames", "[[\"a\",\"b\"]]"), HasSubstr("codes.mu"));
  EXPECT_THAT(with("codes.frames", "7"), HasSubstr("not understood"));
  EXPECT_THAT(with("training", "[[["), HasSubstr("metadata 'training': is no JSON"));
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
