// What is written is read back by tinygltf and played by the specification's rules.

#include "likeness/avatar/export/glb.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <cstring>

#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/geometry/mesh_corners.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

using testing::HasSubstr;

constexpr int kVertices = 5;  // the last one belongs to no triangle

MeshTopology Topology() {
  // The first vertex lies on a seam.
  return {kVertices, {{0, 0}, {1, 0}, {0, 1}, {1, 1}, {0.5f, 0.25f}}, {{0, 1, 2}, {0, 2, 3}}, {{0, 1, 2}, {4, 2, 3}}};
}

// A face whose mesh has three directions for two values of the code.
Vertices Decode(std::span<const float> code) {
  Random random(3);
  const auto field = [&](double size) {
    Vertices moved(kVertices, 3);
    for (int i = 0; i < 3 * kVertices; ++i) moved.data()[i] = static_cast<float>(size * random.Normal());
    return moved;
  };
  const Vertices rest = field(80), a = field(5), b = field(3), both = field(2);
  return rest + code[0] * a + code[1] * b + code[0] * code[1] * both;
}

Performance MakePerformance(int frames) {
  Random random(4);
  Performance p;
  p.latent = 2;
  double seconds = 0;
  for (int i = 0; i < frames; ++i) {
    p.seconds.push_back(seconds);
    seconds += random.Uniform(0.02, 0.05);
    p.codes.push_back(static_cast<float>(random.Normal()));
    p.codes.push_back(static_cast<float>(random.Normal()));
    const Eigen::Matrix3d rotation =
        RotationFromYawPitchRoll(random.Normal() / 3, random.Normal() / 3, random.Normal() / 3);
    p.world_from_head.push_back({rotation, {10 * random.Normal(), 20, -1000 + 5 * random.Normal()}});
  }
  return p;
}

ImageU8 Texture() {
  ImageU8 texture(16, 16, 3);
  for (size_t i = 0; i < texture.values().size(); ++i) texture.values()[i] = static_cast<uint8_t>(i * 7 % 251);
  return texture;
}

// Plays a file as a viewer does.
class Player {
 public:
  explicit Player(const std::string& glb) {
    tinygltf::TinyGLTF reader;
    reader.SetImageLoader(
        [](tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* bytes, int size,
           void*) {
          image->image.assign(bytes, bytes + size);
          return true;
        },
        nullptr);
    std::string error, warning;
    const bool read =
        reader.LoadBinaryFromMemory(&model, &error, &warning, reinterpret_cast<const unsigned char*>(glb.data()),
                                    static_cast<unsigned int>(glb.size()));
    EXPECT_TRUE(read && warning.empty()) << error << warning;
  }

  std::vector<float> Values(int accessor) const {
    const tinygltf::Accessor& a = model.accessors.at(accessor);
    const tinygltf::BufferView& view = model.bufferViews.at(a.bufferView);
    EXPECT_EQ(a.componentType, TINYGLTF_COMPONENT_TYPE_FLOAT);
    std::vector<float> values(a.count * tinygltf::GetNumComponentsInType(a.type));
    EXPECT_EQ(view.byteLength, values.size() * sizeof(float));
    std::memcpy(values.data(), model.buffers.at(view.buffer).data.data() + view.byteOffset, view.byteLength);
    return values;
  }

  // Vertices of the scene in metres.
  Eigen::MatrixX3f At(double seconds) const {
    const tinygltf::Primitive& primitive = model.meshes.at(0).primitives.at(0);
    const std::vector<float> rest = Values(primitive.attributes.at("POSITION"));
    Eigen::VectorXf mesh = Eigen::Map<const Eigen::VectorXf>(rest.data(), static_cast<Eigen::Index>(rest.size()));
    const std::vector<float> weights = Sampled("weights", seconds, primitive.targets.size());
    for (size_t k = 0; k < primitive.targets.size(); ++k) {
      const std::vector<float> target = Values(primitive.targets[k].at("POSITION"));
      mesh += weights[k] * Eigen::Map<const Eigen::VectorXf>(target.data(), mesh.size());
    }
    const std::vector<float> r = Sampled("rotation", seconds, 4), t = Sampled("translation", seconds, 3);
    const Eigen::Matrix3f rotation = Eigen::Quaternionf(r[3], r[0], r[1], r[2]).normalized().toRotationMatrix();
    const Eigen::MatrixX3f points = Eigen::Map<const Vertices>(mesh.data(), mesh.size() / 3, 3);
    return (points * rotation.transpose()).rowwise() + Eigen::RowVector3f(t[0], t[1], t[2]);
  }

  tinygltf::Model model;

 private:
  // Linear interpolation; of short arcs between rotations it is near enough to the sphere's only at the frames and,
  // by symmetry, in the middle.
  std::vector<float> Sampled(const std::string& path, double seconds, size_t width) const {
    const tinygltf::Animation& animation = model.animations.at(0);
    for (const tinygltf::AnimationChannel& channel : animation.channels) {
      if (channel.target_path != path) continue;
      const tinygltf::AnimationSampler& sampler = animation.samplers.at(channel.sampler);
      EXPECT_EQ(sampler.interpolation, "LINEAR");
      const std::vector<float> times = Values(sampler.input), values = Values(sampler.output);
      EXPECT_EQ(values.size(), times.size() * width);
      size_t next = 1;
      while (next + 1 < times.size() && times[next] < seconds) ++next;
      const auto share = static_cast<float>((seconds - times[next - 1]) / (times[next] - times[next - 1]));
      std::vector<float> sampled(width);
      for (size_t i = 0; i < width; ++i) {
        sampled[i] = (1 - share) * values[(next - 1) * width + i] + share * values[next * width + i];
      }
      return sampled;
    }
    ADD_FAILURE() << "no channel " << path;
    return std::vector<float>(width);
  }
};

// The largest distance between the file's vertices and the posed mesh, mm.
double Distance(const Eigen::MatrixX3f& in_metres, const Vertices& mesh, const RigidTransform& pose) {
  const MeshCorners corners = CornersOf(Topology());
  EXPECT_EQ(in_metres.rows(), static_cast<Eigen::Index>(corners.vertices.size()));
  double most = 0;
  for (size_t i = 0; i < corners.vertices.size(); ++i) {
    const Eigen::Vector3d expected = pose * mesh.row(corners.vertices[i]).transpose().cast<double>();
    const Eigen::Vector3d found = 1000 * in_metres.row(static_cast<Eigen::Index>(i)).transpose().cast<double>();
    most = std::max(most, (expected - found).norm());
  }
  return most;
}

TEST(GlbTest, PlaysThePerformance) {
  const Performance p = MakePerformance(9);
  AnimateOptions options;
  options.tolerance_mm = 0;
  const AnimatedMesh mesh = Animate(p, Decode, Topology(), options);
  EXPECT_LT(mesh.largest_error_mm, 1e-3);
  const Player player(GlbBytes(mesh, Texture()));
  const RigidTransform first_from_world = p.world_from_head.front().Inverse();
  for (int i = 0; i < p.frame_count(); ++i) {
    EXPECT_LT(Distance(player.At(p.seconds[i]), Decode(p.Code(i)), first_from_world * p.world_from_head[i]), 2e-3) << i;
  }
  for (int i = 0; i + 1 < p.frame_count(); ++i) {
    const double middle = (p.seconds[i] + p.seconds[i + 1]) / 2;
    const Vertices mean = (Decode(p.Code(i)) + Decode(p.Code(i + 1))) / 2;
    EXPECT_LT(Distance(player.At(middle), mean, first_from_world * MomentAt(p, middle).world_from_head), 5e-3) << i;
  }
}

TEST(GlbTest, HasTextureAndSeams) {
  const AnimatedMesh mesh = Animate(MakePerformance(1), Decode, Topology());
  EXPECT_TRUE(mesh.targets.empty());
  const Player player(GlbBytes(mesh, Texture()));
  EXPECT_TRUE(player.model.animations.empty());
  const tinygltf::Primitive& primitive = player.model.meshes.at(0).primitives.at(0);
  // Five corners: the first vertex has two texture coordinates. v runs down.
  EXPECT_THAT(player.Values(primitive.attributes.at("TEXCOORD_0")),
              testing::ElementsAre(0, 1, 1, 1, 0, 0, 0.5f, 0.75f, 1, 0));
  const MeshCorners corners = CornersOf(Topology());
  EXPECT_THAT(corners.vertices, testing::ElementsAre(0, 1, 2, 0, 3));
  EXPECT_THAT(corners.indices, testing::ElementsAre(0, 1, 2, 3, 2, 4));
  const std::vector<unsigned char>& png = player.model.images.at(0).image;
  EXPECT_EQ(DecodeImage("png", {reinterpret_cast<const char*>(png.data()), png.size()}), Texture());
  EXPECT_THAT(player.model.extensionsUsed, testing::ElementsAre("KHR_materials_unlit"));
}

TEST(AnimateTest, SaysHowFarItIsOff) {
  const Performance p = MakePerformance(12);
  AnimateOptions options;
  options.most_targets = 2;
  const AnimatedMesh mesh = Animate(p, Decode, Topology(), options);
  ASSERT_EQ(mesh.targets.size(), 2);
  double sum = 0, most = 0;
  for (int i = 0; i < p.frame_count(); ++i) {
    const Vertices difference = mesh.At(i) - Decode(p.Code(i));
    for (int v = 0; v < kVertices - 1; ++v) {
      sum += difference.row(v).norm();
      most = std::max<double>(most, difference.row(v).norm());
    }
  }
  EXPECT_GT(mesh.mean_error_mm, 0.1);
  EXPECT_NEAR(mesh.mean_error_mm, sum / 12 / (kVertices - 1), 1e-5);
  EXPECT_NEAR(mesh.largest_error_mm, most, 1e-5);
  for (const float weight : mesh.weights) EXPECT_LE(std::abs(weight), 1.000001f);
  // A third direction is all there is; fewer suffice where more error is allowed.
  EXPECT_EQ(Animate(p, Decode, Topology(), {32, 1e-3}).targets.size(), 3);
  EXPECT_LT(Animate(p, Decode, Topology(), {32, 100}).targets.size(), 2);
  EXPECT_THAT(ErrorOf([&] { Animate(p, Decode, Topology(), {0, 1}); }), HasSubstr("1 to 256 targets"));
}

}  // namespace
}  // namespace likeness
