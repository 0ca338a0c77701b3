#include "likeness/train/model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/avatar/plain_network.h"
#include "likeness/avatar/tensor_registry.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::HasSubstr;

Avatar RandomAvatar() {
  Avatar avatar;
  avatar.architecture.texture_size = 16;
  avatar.architecture.vertex_count = 4;
  avatar.architecture.latent = 3;
  avatar.topology.vertex_count = 4;
  avatar.topology.uvs = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  avatar.topology.triangles = avatar.topology.triangle_uvs = {{0, 1, 2}, {2, 1, 3}};
  Random random(7);
  avatar.identities[0].texture_mean = ImageF(16, 16, 3);
  for (float& v : avatar.identities[0].texture_mean.values()) v = static_cast<float>(random.Uniform(50, 200));
  avatar.texture_variance = 400;
  avatar.identities[0].vertex_mean = Vertices(4, 3);
  for (int i = 0; i < 12; ++i) avatar.identities[0].vertex_mean.data()[i] = static_cast<float>(random.Normal());
  avatar.vertex_variance = 9;
  for (const TensorInfo& info : NetworkTensors(avatar.architecture)) {
    Tensor& tensor = avatar.weights[info.name];
    tensor = {info.shape, std::vector<float>(ElementCount(info.shape))};
    for (float& v : tensor.values) v = static_cast<float>(random.Normal() * 0.1);
  }
  return avatar;
}

// Decoding a file's avatar gives the plain network's values in pixels and millimetres, row 0 first.
TEST(AvatarModel, DecodesInPixelsAndMillimetres) {
  const ScratchFolder folder;
  const Avatar avatar = RandomAvatar();
  SaveAvatar(folder / "a.safetensors", avatar);
  const auto model = AvatarModel::Load(folder / "a.safetensors");
  const std::vector<float> code = {0.5f, -1, 2};
  const Eigen::Vector3d view = Eigen::Vector3d(1, 2, 3).normalized();
  const DecodedFrame frame = model->Decode(code, view);

  const PlainNetwork plain{avatar.architecture, avatar.weights};
  const std::vector<double> z(code.begin(), code.end());
  const std::vector<double> texture = plain.DecodeTexture(z, {view.x(), view.y(), view.z()});
  const std::vector<double> vertices = plain.DecodeVertices(z);
  ASSERT_EQ(frame.texture.width(), 16);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(frame.texture.at(x, y)[c],
                    avatar.identities[0].texture_mean.at(x, y)[c] + 20 * texture[(c * 16 + y) * 16 + x], 1e-3);
      }
    }
  }
  for (int v = 0; v < 4; ++v) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(frame.vertices_in_head(v, k), avatar.identities[0].vertex_mean(v, k) + 3 * vertices[3 * v + k], 1e-4);
    }
  }
}

// The second person under given conditions: the condition vector beside the code, and the person's own means.
TEST(AvatarModel, EncodesAndDecodesAsEachPerson) {
  Avatar avatar = RandomAvatar();
  avatar.architecture.identities = 2;
  avatar.architecture.identity = IdentityConditioning::kLearned;
  avatar.architecture.identity_size = 2;
  avatar.architecture.conditions = {{"gaze", 2}};
  avatar.condition_mean = {1, 2};
  avatar.condition_deviation = {0.5f, 0.5f};
  avatar.identities.push_back(avatar.identities[0]);
  avatar.identities[0].name = "anna";
  avatar.identities[1].name = "ben";
  for (float& v : avatar.identities[1].texture_mean.values()) v = 200 - v;
  avatar.identities[1].vertex_mean *= -2;
  Random random(9);
  for (const TensorInfo& info : NetworkTensors(avatar.architecture)) {
    Tensor& tensor = avatar.weights[info.name];
    tensor = {info.shape, std::vector<float>(ElementCount(info.shape))};
    for (float& v : tensor.values) v = static_cast<float>(random.Normal() * 0.2);
  }
  const AvatarModel model(avatar);
  const PlainNetwork plain{avatar.architecture, avatar.weights};
  const std::vector<double> c = plain.Condition(1, {-2, 4});  // (0 - 1) / 0.5, (4 - 2) / 0.5
  const FrameConditions conditions = {1, {0, 4}};

  const std::vector<float> code = {0.5f, -1, 2};
  const DecodedFrame frame = model.Decode(code, {0, 0, 1}, conditions);
  const std::vector<double> z(code.begin(), code.end());
  const std::vector<double> texture = plain.DecodeTexture(z, {0, 0, 1}, c), mesh = plain.DecodeVertices(z, c);
  const Identity& ben = avatar.identities[1];
  for (int i = 0; i < 12; ++i) {
    EXPECT_NEAR(frame.vertices_in_head.data()[i], ben.vertex_mean.data()[i] + 3 * mesh[i], 1e-4);
  }
  for (const int y : {0, 3, 15}) {
    EXPECT_NEAR(frame.texture.at(5, y)[2], ben.texture_mean.at(5, y)[2] + 20 * texture[(2 * 16 + y) * 16 + 5], 1e-3);
  }

  const ImageU8 average(16, 16, 3, 100);
  const Vertices vertices = ben.vertex_mean + Vertices::Constant(4, 3, 1.5f);
  std::vector<double> standard_texture(3 * 16 * 16);
  for (int i = 0; i < 3 * 16 * 16; ++i) {
    standard_texture[i] = (100 - ben.texture_mean.at(i % 16, i / 16 % 16)[i / 256]) / 20.0;
  }
  const std::vector<double> expected = plain.Encode(standard_texture, std::vector<double>(12, 0.5), c);
  const std::vector<float> mu = model.Encode(average, vertices, {}, conditions);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(mu[i], expected[i], 1e-4);

  // Anybody else, or other conditions, is something else; what is not said are the means.
  EXPECT_NE(model.Decode(code, {0, 0, 1}, {0, {0, 4}}).texture, frame.texture);
  EXPECT_EQ(model.Decode(code, {0, 0, 1}, {0, {1, 2}}).texture, model.Decode(code, {0, 0, 1}).texture);
  EXPECT_THAT(ErrorOf([&] { model.Decode(code, {0, 0, 1}, {2, {}}); }), HasSubstr("no person 2"));
  EXPECT_THAT(ErrorOf([&] { model.Decode(code, {0, 0, 1}, {0, {1}}); }), HasSubstr("this avatar has 2"));
}

TEST(AvatarModel, EncodesTheStandardisedFrame) {
  const Avatar avatar = RandomAvatar();
  const AvatarModel model(avatar);
  Random random(8);
  ImageU8 texture(16, 16, 3), seen(16, 16, 1);
  for (uint8_t& v : texture.values()) v = static_cast<uint8_t>(1 + random.Below(255));
  for (uint8_t& v : seen.values()) v = random.Below(4) == 0 ? 0 : 255;
  const Vertices vertices = avatar.identities[0].vertex_mean + Vertices::Random(4, 3);

  std::vector<double> standard_texture(3 * 256), standard_vertices(12);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      for (int c = 0; c < 3; ++c) {
        standard_texture[(c * 16 + y) * 16 + x] =
            seen.at(x, y)[0] == 0 ? 0 : (texture.at(x, y)[c] - avatar.identities[0].texture_mean.at(x, y)[c]) / 20.0;
      }
    }
  }
  for (int i = 0; i < 12; ++i) {
    standard_vertices[i] = (vertices.data()[i] - avatar.identities[0].vertex_mean.data()[i]) / 3.0;
  }
  const PlainNetwork plain{avatar.architecture, avatar.weights};
  const std::vector<double> expected = plain.Encode(standard_texture, standard_vertices);
  const std::vector<float> mu = model.Encode(texture, vertices, seen);
  ASSERT_EQ(mu.size(), 3);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(mu[i], expected[i], 1e-5);

  // Without a mask, black texels are the unseen ones.
  for (size_t i = 0; i < 256; ++i) {
    if (seen.values()[i] == 0) std::fill_n(texture.values().begin() + 3 * i, 3, 0);
  }
  EXPECT_EQ(model.Encode(texture, vertices), mu);
}

TEST(AvatarModel, SaysWhatDoesNotFit) {
  const AvatarModel model(RandomAvatar());
  const std::vector<float> code = {0, 0, 0}, longer = {0, 0, 0, 0};
  const Eigen::Vector3d view(0, 0, 1);
  const Vertices vertices = Vertices::Zero(4, 3);
  EXPECT_THAT(ErrorOf([&] { model.Decode(longer, view); }), HasSubstr("4 values"));
  EXPECT_THAT(ErrorOf([&] { model.Decode(code, 2 * view); }), HasSubstr("unit vector"));
  EXPECT_THAT(ErrorOf([&] { model.Decode(code, view * std::nan("")); }), HasSubstr("unit vector"));
  EXPECT_THAT(ErrorOf([&] { model.Encode(ImageU8(8, 8, 3), vertices); }), HasSubstr("8 x 8 x 3"));
  EXPECT_THAT(ErrorOf([&] { model.Encode(ImageU8(16, 16, 3), vertices, ImageU8(8, 8, 1)); }), HasSubstr("8 x 8"));
  EXPECT_THAT(ErrorOf([&] { model.Encode(ImageU8(16, 16, 3), Vertices::Zero(5, 3)); }), HasSubstr("5 vertices"));
  EXPECT_THAT(ErrorOf([&] { AvatarModel(RandomAvatar(), "tpu"); }), HasSubstr("device 'tpu'"));
}

}  // namespace
}  // namespace likeness
