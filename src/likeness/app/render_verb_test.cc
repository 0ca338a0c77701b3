// The verb `render` as a user calls it, on an avatar of random weights that is shaped like a head.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/avatar/performance.h"
#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/decode/random_avatar.h"
#include "likeness/image/image_io.h"
#include "likeness/simulate/procedural_head.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kFrames = 3;  // RandomAvatar's codes

class RenderVerbTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ProceduralOptions coarse;
    coarse.detail = 1;
    const auto head = MakeProceduralHead(coarse);
    const std::array<float, kExpressionCount> rest = {};
    Architecture a;
    a.texture_size = 64;
    a.vertex_count = head->tracked_topology().vertex_count;
    a.latent = 8;
    avatar_ = RandomAvatar(a, 1);
    avatar_.topology = head->tracked_topology();
    avatar_.identities[0].vertex_mean = head->Pose(rest).tracked;
    avatar_.vertex_variance = 0.01;
    // Redder towards the subject's left.
    avatar_.texture_variance = 4;
    for (int i = 0; i < 64 * 64; ++i)
      avatar_.identities[0].texture_mean.values()[3 * i] = static_cast<float>(4 * (i % 64));
    SaveAvatar(Path("a.safetensors"), avatar_);
  }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  // likeness render a.safetensors OUT --width 60 --height 80 ...
  void Render(const std::string& out, const std::vector<std::string>& options) const {
    std::vector<std::string> words = {"render",  Path("a.safetensors"), Path(out), "--width", "60", "--height", "80",
                                      "--quiet", "--threads",           "2"};
    words.insert(words.end(), options.begin(), options.end());
    std::vector<const char*> argv;
    for (const std::string& word : words) argv.push_back(word.c_str());
    testing::internal::CaptureStdout();
    try {
      RunRender(static_cast<int>(argv.size()), argv.data());
    } catch (...) {
      testing::internal::GetCapturedStdout();
      throw;
    }
    EXPECT_EQ(testing::internal::GetCapturedStdout(), Path(out) + "\n");
  }

  std::string ErrorOfRender(const std::string& out, const std::vector<std::string>& options) const {
    try {
      Render(out, options);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  }

  const ScratchFolder folder_;
  Avatar avatar_;
};

TEST_F(RenderVerbTest, ATurntablesFrameIsTheStillFromThere) {
  Render("turn/", {"--turntable", "0.2", "--fps", "20", "--focal", "200", "--view", "10,5"});
  EXPECT_THAT(ListFolder(Path("turn")), ::testing::ElementsAre("000000.png", "000001.png", "000002.png", "000003.png"));
  Render("still.png", {"--focal", "200", "--view", "100,5"});
  EXPECT_EQ(ReadImage(Path("turn/000001.png")), ReadImage(Path("still.png")));
  EXPECT_FALSE(ReadImage(Path("turn/000002.png")) == ReadImage(Path("still.png")));
  EXPECT_TRUE(Exists(Path("turn.toml")) && Exists(Path("still.toml")));
  // A folder with something in it is left alone.
  EXPECT_THAT(ErrorOfRender("turn/", {"--turntable", "0.1"}), HasSubstr("there already"));
}

TEST_F(RenderVerbTest, TheLeftEyeIsAtTheLeft) {
  const std::vector<std::string> options = {"--focal", "300", "--view", "90,0"};
  auto stereo = options, left = options;
  stereo.insert(stereo.end(), {"--stereo", "side-by-side", "--eye-distance", "400"});
  Render("both.png", stereo);
  const ImageU8 both = ReadImage(Path("both.png"));
  ASSERT_EQ(both.width(), 120);
  // From the subject's left side, the viewer's left is where the face looks: 200 mm to there, at 1100 mm, is a turn of
  // 10.3 degrees about the head's middle. The pictures' planes differ, so what one sees is not quite the same.
  left[3] = "79.7,0";
  Render("left.png", left);
  const ImageU8 still = ReadImage(Path("left.png"));
  double from_left = 0, from_right = 0;
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 60; ++x) {
      from_left += std::abs(still.at(x, y)[0] - both.at(x, y)[0]);
      from_right += std::abs(still.at(x, y)[0] - both.at(60 + x, y)[0]);
    }
  }
  EXPECT_LT(from_left, 0.4 * from_right);
}

TEST_F(RenderVerbTest, VideosHaveAllFrames) {
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nowhere", 1);
  EXPECT_THAT(ErrorOfRender("clip.mp4", {"--segment", "random"}), HasSubstr("ffmpeg"));
  // ffmpeg is a script that keeps the bytes.
  WriteFile(Path("bin/ffmpeg"), "#!/bin/sh\nfor last; do :; done\ncat > \"${last#file:}\"\n");
  fs::permissions(Path("bin/ffmpeg"), fs::perms::owner_all);
  setenv("PATH", (Path("bin") + ":" + path).c_str(), 1);
  Render("clip.mp4", {"--segment", "random"});
  setenv("PATH", path.c_str(), 1);
  const std::string video = ReadFile(Path("clip.mp4"));
  constexpr size_t kBytes = size_t{60} * 80 * 3;
  ASSERT_EQ(video.size(), kFrames * kBytes);
  Render("frame.png", {"--frame", "1"});
  const ImageU8 frame = ReadImage(Path("frame.png"));
  EXPECT_EQ(video.substr(kBytes, kBytes), std::string(frame.values().begin(), frame.values().end()));
}

TEST_F(RenderVerbTest, CodesAndPerformancesAreAsTheirFrames) {
  std::string text;
  Performance performance;
  performance.latent = 8;
  for (int i = 0; i < kFrames; ++i) {
    for (const float v : avatar_.codes[i].mu) text += fmt::format("{} ", v);
    performance.seconds.push_back(0.1 * i);
    performance.codes.insert(performance.codes.end(), avatar_.codes[i].mu.begin(), avatar_.codes[i].mu.end());
    performance.world_from_head.push_back({RotationFromYawPitchRoll(0.3 * i, 0, 0), Eigen::Vector3d(500, 20 * i, 70)});
  }
  WriteFile(Path("codes.txt"), text);
  WritePerformance(Path("p.safetensors"), performance);
  Render("codes/", {"--codes", Path("codes.txt")});
  Render("segment/", {"--segment", "random"});
  Render("played/", {"--performance", Path("p.safetensors"), "--fps", "10"});
  ASSERT_EQ(ListFolder(Path("codes")).size(), static_cast<size_t>(kFrames));
  ASSERT_EQ(ListFolder(Path("played")).size(), static_cast<size_t>(kFrames));
  Render("one.png", {"--frame", "2"});
  EXPECT_EQ(ReadImage(Path("codes/000002.png")), ReadImage(Path("one.png")));
  EXPECT_EQ(ReadImage(Path("segment/000002.png")), ReadImage(Path("one.png")));
  // The head has moved since the first frame.
  EXPECT_EQ(ReadImage(Path("played/000000.png")), ReadImage(Path("codes/000000.png")));
  EXPECT_FALSE(ReadImage(Path("played/000002.png")) == ReadImage(Path("one.png")));
}

TEST_F(RenderVerbTest, MistakesAreNamed) {
  EXPECT_THAT(ErrorOfRender("a.png", {"--turntable", "1"}), HasSubstr("30 pictures do not go into one PNG"));
  EXPECT_THAT(ErrorOfRender("a.jpg", {}), HasSubstr("expected NAME.png"));
  EXPECT_THAT(ErrorOfRender("a.mp4", {"--transparent"}), HasSubstr("--transparent"));
  EXPECT_THAT(ErrorOfRender("a.png", {"--segment", "rendom"}), HasSubstr("did you mean 'random'"));
  EXPECT_THAT(ErrorOfRender("a.png", {"--segment", "random", "--frame", "1"}), HasSubstr("one at most"));
  EXPECT_THAT(ErrorOfRender("a.png", {"--beside-truth", "somewhere"}), HasSubstr("--camera"));
  EXPECT_THAT(ErrorOfRender("a.png", {"--background", "1,2,300"}), HasSubstr("--background"));
  WriteFile(Path("codes.txt"), "1 2 3");
  EXPECT_THAT(ErrorOfRender("a.png", {"--codes", Path("codes.txt")}), HasSubstr("codes.txt"));
  EXPECT_FALSE(Exists(Path("a.png")) || Exists(Path("a.toml")));
}

}  // namespace
}  // namespace likeness
