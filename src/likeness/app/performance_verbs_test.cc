// The verbs `drive` and `export` as a user runs them, on an avatar with random weights.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/avatar/arkit_map.h"
#include "likeness/avatar/avatar_id.h"
#include "likeness/avatar/performance.h"
#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/decode/decoder.h"
#include "likeness/decode/export/onnx.h"
#include "likeness/decode/random_avatar.h"
#include "likeness/geometry/obj.h"
#include "likeness/geometry/ply.h"
#include "likeness/image/image_io.h"
#include "likeness/simulate/gaze_condition.h"
#include "likeness/simulate/live_link.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

int RunVerb(Verb verb, const std::vector<std::string>& arguments) {
  std::vector<const char*> argv = {"verb"};
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  return verb(static_cast<int>(argv.size()), argv.data());
}

class PerformanceVerbsTest : public ::testing::Test {
 protected:
  PerformanceVerbsTest() {
    Architecture architecture;
    architecture.texture_size = 32;
    architecture.vertex_count = 12;
    architecture.latent = 3;
    architecture.conditions = {{"gaze", 6}};
    avatar_ = RandomAvatar(architecture, 1);
    SaveAvatar(Path("plain.safetensors"), avatar_);
    // The first value is the jaw, the second the product of jaw and funnel, the third a constant.
    const int jaw = ExpressionIndex("jawOpen"), funnel = ExpressionIndex("mouthFunnel");
    const ArkitMap map{{ExpressionNames().begin(), ExpressionNames().end()},
                       {{jaw, -1}, {jaw, funnel}},
                       {0, 0, 7},
                       {1, 0, 0, 2, 0, 0}};
    WriteWithArkitMap(Path("avatar.safetensors"), SafetensorsFile(Path("plain.safetensors")), map);
    WriteFile(Path("take.csv"), Recording());
  }

  // Three rows, of which the second has the time of the first. Weights are 0.5, yaw turns to 0.3.
  static std::string Recording() {
    std::string header = "Timecode,BlendShapeCount", rest;
    for (const std::string& name : ExpressionNames()) {
      header += "," + name;
      rest += ",0.5";
    }
    return header + ",HeadYaw,HeadPitch,HeadRoll\n00:00:01:00.0,55" + rest + ",0,0,0\n00:00:01:00.0,55" + rest +
           ",0,0,0\n00:00:01:12.0,55" + rest + ",0.3,0,0\n";
  }

  std::string Path(const std::string& name) const { return (scratch_ / name).string(); }

  Vertices Decode(std::span<const float> code) const {
    Vertices mesh(12, 3);
    Decoder::Open(Path("avatar.safetensors"))->Decode(code, {}, {mesh.data()});
    return mesh;
  }

  const ScratchFolder scratch_;
  Avatar avatar_;
};

TEST_F(PerformanceVerbsTest, ARecordingDrivesTheAvatar) {
  ASSERT_EQ(RunVerb(RunDrive, {Path("avatar.safetensors"), Path("take.csv"), Path("take.perf.safetensors")}), 0);
  const Performance p = ReadPerformance(Path("take.perf.safetensors"));
  CheckBelongs(p, "take", avatar_.architecture, AvatarId(avatar_));
  ASSERT_EQ(p.frame_count(), 2);
  EXPECT_THAT(p.seconds, ::testing::ElementsAre(0, ::testing::DoubleNear(0.5, 1e-9)));  // 12 of 24 frames a second
  EXPECT_THAT(p.Code(1), ::testing::ElementsAre(0.5f, 0.5f, 7));
  EXPECT_LT((p.world_from_head[1].rotation - RotationFromYawPitchRoll(0.3, 0, 0)).norm(), 1e-12);
  // The head turns about its neck, which stays where it is.
  EXPECT_NEAR((p.world_from_head[1] * Eigen::Vector3d(0, -80, -35) - Eigen::Vector3d(0, -80, -35)).norm(), 0, 1e-9);
  std::array<float, kExpressionCount> weights;
  weights.fill(0.5f);
  EXPECT_THAT(p.ConditionValues(1), ::testing::ElementsAreArray(GazeDirections(weights)));
  EXPECT_TRUE(fs::exists(Path("take.perf.toml")));

  RunVerb(RunDrive, {Path("avatar.safetensors"), Path("take.csv"), Path("still.safetensors"), "--no-head-motion"});
  EXPECT_EQ(ReadPerformance(Path("still.safetensors")).world_from_head[1].rotation, Eigen::Matrix3d::Identity());
  EXPECT_THAT(ErrorOf([&] {
                RunVerb(RunDrive, {Path("plain.safetensors"), Path("take.csv"), Path("none.safetensors")});
              }),
              HasSubstr("fit-arkit"));
  EXPECT_FALSE(fs::exists(Path("none.safetensors")));
}

TEST_F(PerformanceVerbsTest, FramesAreExported) {
  const std::vector<float>& code = avatar_.codes[1].mu;
  ASSERT_EQ(RunVerb(RunExport, {Path("avatar.safetensors"), Path("face.obj"), "--frame", "1", "--view", "90,0"}), 0);
  const ObjFile obj = ReadObj(Path("face.obj"));
  EXPECT_EQ(obj.vertices, Decode(code));
  EXPECT_EQ(obj.uvs, avatar_.topology.uvs);
  EXPECT_THAT(ReadFile(Path("face.obj")), ::testing::StartsWith("mtllib face.mtl\nusemtl face\n"));
  EXPECT_THAT(ReadFile(Path("face.mtl")), HasSubstr("map_Kd face.png"));
  std::vector<uint8_t> pixels(32 * 32 * 4);
  const Decoder::View left{{1, 0, 0}, pixels.data(), 32 * 4};
  Decoder::Open(Path("avatar.safetensors"))->Decode(code, {&left, 1}, {});
  const ImageU8 texture = ReadImage(Path("face.png"));
  for (size_t i = 0; i < 32 * 32; ++i) {
    for (size_t c = 0; c < 3; ++c) ASSERT_NEAR(texture.values()[3 * i + c], pixels[4 * i + c], 1);
  }

  ASSERT_EQ(RunVerb(RunExport, {Path("avatar.safetensors"), Path("face.ply"), "--frame", "1"}), 0);
  EXPECT_EQ(ParsePly("face.ply", ReadFile(Path("face.ply"))).vertices, obj.vertices);
}

TEST_F(PerformanceVerbsTest, MomentsAndPerformancesAreExported) {
  Performance p;
  p.latent = 3;
  p.seconds = {0, 1};
  p.codes = {1, 2, 3, -1, 0, 1};
  p.world_from_head.resize(2);
  WritePerformance(Path("talk.perf.safetensors"), p);
  const auto run = [&](std::vector<std::string> more) {
    more.insert(more.begin(), Path("avatar.safetensors"));
    more.insert(more.end(), {"--performance", Path("talk.perf.safetensors")});
    return RunVerb(RunExport, more);
  };
  ASSERT_EQ(run({Path("middle.ply"), "--at", "0.5"}), 0);
  const std::vector<float> middle = {0, 1, 2};
  EXPECT_EQ(ParsePly("middle.ply", ReadFile(Path("middle.ply"))).vertices, Decode(middle));
  ASSERT_EQ(run({Path("talk.glb")}), 0);
  EXPECT_THAT(ReadFile(Path("talk.glb")), ::testing::StartsWith("glTF"));
  EXPECT_THROW(run({Path("talk.obj")}), UsageError);
  EXPECT_THROW(run({Path("talk.fbx")}), UsageError);
  EXPECT_THROW(run({Path("talk.onnx")}), UsageError);
  p.avatar = "0123456789abcdef";
  WritePerformance(Path("talk.perf.safetensors"), p);
  EXPECT_THAT(ErrorOf([&] { run({Path("other.glb")}); }), HasSubstr("another avatar"));
  EXPECT_FALSE(fs::exists(Path("other.glb")));
}

TEST_F(PerformanceVerbsTest, TheDecoderIsExported) {
  ASSERT_EQ(RunVerb(RunExport, {Path("avatar.safetensors"), Path("face.onnx")}), 0);
  const std::string by_name = ReadFile(Path("face.onnx"));
  EXPECT_EQ(by_name, OnnxBytes(Path("avatar.safetensors")));
  EXPECT_TRUE(fs::exists(Path("face.toml")));
  ASSERT_EQ(RunVerb(RunExport, {Path("avatar.safetensors"), Path("model"), "--format", "onnx"}), 0);
  EXPECT_EQ(ReadFile(Path("model")), by_name);
  EXPECT_THROW(RunVerb(RunExport, {Path("avatar.safetensors"), Path("turned.onnx"), "--view", "10,0"}), UsageError);
  EXPECT_FALSE(fs::exists(Path("turned.onnx")));
}

}  // namespace
}  // namespace likeness
