// The whole path as a user takes it, with the program itself: simulate, inspect, unwrap, train, evaluate, render. Small
// and procedural; what comes out is compared with the capture's truth and with what an avatar that learnt nothing
// gives.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "likeness/avatar/arkit_map.h"
#include "likeness/avatar/avatar.h"
#include "likeness/avatar/performance.h"
#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/capture/capture.h"
#include "likeness/capture/layout.h"
#include "likeness/image/image_io.h"
#include "likeness/texture/texture_set.h"
#include "likeness/train/evaluate.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct Outcome {
  int status = 0;
  std::string out;  // stdout
  std::string err;  // stderr
};

class EndToEndTest : public ::testing::Test {
 protected:
  // One capture and one avatar for all tests: the first one makes them.
  static void SetUpTestSuite() { scratch_ = new ScratchFolder; }
  static void TearDownTestSuite() {
    delete scratch_;
    scratch_ = nullptr;
  }

  static Outcome Likeness(const std::string& arguments) {
    const fs::path err = *scratch_ / "stderr.txt";
    const std::string command = std::string(LIKENESS_PROGRAM) + " " + arguments + " 2>'" + err.string() + "'";
    Outcome outcome;
    FILE* pipe = popen(command.c_str(), "r");
    std::array<char, 4096> buffer;
    while (const size_t size = fread(buffer.data(), 1, buffer.size(), pipe)) outcome.out.append(buffer.data(), size);
    outcome.status = WEXITSTATUS(pclose(pipe));
    outcome.err = ReadFile(err);
    return outcome;
  }

  static std::string Path(const std::string& name) { return (*scratch_ / name).string(); }

  static ScratchFolder* scratch_;
};

ScratchFolder* EndToEndTest::scratch_ = nullptr;

// Newest change of any file below a folder.
fs::file_time_type NewestChange(const fs::path& folder) {
  fs::file_time_type newest = fs::file_time_type::min();
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) newest = std::max(newest, entry.last_write_time());
  }
  return newest;
}

// Shows the same for every code and view.
class MeanDecoder : public FrameDecoder {
 public:
  explicit MeanDecoder(const TextureStatistics& statistics) {
    mean_.texture = statistics.mean;
    mean_.vertices_in_head = Eigen::Map<const Vertices>(
        statistics.vertex_mean.data(), static_cast<Eigen::Index>(statistics.vertex_mean.size() / 3), 3);
  }
  DecodedFrame Decode(std::span<const float>, const Eigen::Vector3d&, const FrameConditions&) const override {
    return mean_;
  }

 private:
  DecodedFrame mean_;
};

TEST_F(EndToEndTest, FromNothingToAnAvatar) {
  const std::string capture = Path("capture"), avatar = Path("avatar");

  const std::string simulate = "simulate " + capture +
                               " --head procedural --cameras 7 --held-out-cameras 2 --frames 12 --width 96 --height 144"
                               " --lights 24 --quiet";
  Outcome outcome = Likeness(simulate);
  ASSERT_EQ(outcome.status, 0) << outcome.err;

  outcome = Likeness("inspect " + capture + " --json --sheet " + Path("sheet.png"));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out).at("cameras").size(), 7u);
  EXPECT_GT(ReadImage(Path("sheet.png")).width(), 400);

  const std::string unwrap = "unwrap " + capture + " --size 128 --quiet";
  outcome = Likeness(unwrap);
  ASSERT_EQ(outcome.status, 0) << outcome.err;

  // A second run finds everything done.
  const auto before = NewestChange(fs::path(capture) / "unwrapped_uv_128");
  const auto images_before = NewestChange(fs::path(capture) / "images");
  ASSERT_EQ(Likeness(simulate).status, 0);
  ASSERT_EQ(Likeness(unwrap).status, 0);
  EXPECT_EQ(NewestChange(fs::path(capture) / "images"), images_before);
  const auto opened = OpenCapture(capture);
  for (const Camera& camera : opened->cameras()) {
    const fs::path texture = CaptureLayout(capture).Texture(opened->frames().front(), camera.name, 128);
    EXPECT_LE(fs::last_write_time(texture), before);
  }

  outcome = Likeness("train " + capture + " " + avatar + " --size 128 --iterations 250 --minutes 0 --quiet --json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;

  outcome = Likeness("evaluate " + avatar + " " + capture + " --json --pictures " + Path("pictures") + " --report " +
                     Path("report.html") + " --quiet");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto result = nlohmann::json::parse(outcome.out);

  // An avatar that learnt nothing shows the mean texture on the mean mesh.
  const TextureSet textures(*opened, 128);
  const MeanDecoder mean(textures.ReadStatistics());
  const auto no_code = [](const FrameId&, const TrackedFrame&) { return EncodedFrame(); };
  const EvaluationResult learnt_nothing = Evaluate(*opened, no_code, mean, {});
  for (const GroupResult& nothing : learnt_nothing.groups) {
    const std::string group = ToString(nothing.group);
    SCOPED_TRACE(group);
    const auto& figures = result.at(group);
    EXPECT_EQ(figures.at("images").get<int>(), nothing.images);
    EXPECT_LT(figures.at("mse").get<double>(), 0.8 * nothing.error.Mean());
    EXPECT_LT(figures.at("vertex_mm").get<double>(), 0.8 * nothing.vertex_mm);
  }
  EXPECT_THAT(ReadFile(Path("report.html")), HasSubstr("data:image/"));

  outcome = Likeness("render " + avatar + " " + Path("face.png") + " --view 20,5 --width 120 --height 160 --quiet");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const ImageU8 face = ReadImage(Path("face.png"));
  int lit = 0;
  for (int y = 0; y < face.height(); ++y) {
    for (int x = 0; x < face.width(); ++x) lit += face.at(x, y)[0] > 30;
  }
  EXPECT_GT(lit, face.width() * face.height() / 5);

  ASSERT_EQ(Likeness("encode " + avatar + " " + capture + " " + Path("all.perf.safetensors") + " --quiet").status, 0);
  const Performance performance = ReadPerformance(Path("all.perf.safetensors"));
  EXPECT_EQ(performance.frame_count(), static_cast<int>(opened->frames().size()));

  outcome = Likeness("fit-arkit " + avatar + " " + capture + " --json --quiet");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto fit = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(fit.at("held_out_segments").at("frames").get<size_t>(), opened->HeldOutFrames().size());
  EXPECT_LT(fit.at("training").at("map_mm").get<double>(), fit.at("training").at("mean_face_mm").get<double>());
  const SafetensorsFile file(fs::path(avatar) / "avatar.safetensors");
  EXPECT_TRUE(ReadArkitMap(file, performance.latent));

  outcome = Likeness("export " + avatar + " " + Path("all.glb") + " --performance " + Path("all.perf.safetensors"));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("morph targets"));

  const Avatar loaded = LoadAvatar(fs::path(avatar) / "avatar.safetensors");
  EXPECT_EQ(loaded.architecture.texture_size, 128);
  EXPECT_EQ(loaded.codes.size(), opened->TrainingFrames().size());
}

TEST_F(EndToEndTest, MistakesAreSaidAndNothingIsLeftBehind) {
  Outcome outcome = Likeness("simulat x");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.err, HasSubstr("did you mean 'simulate'?"));

  outcome = Likeness("train x y --iteration 5");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.err, HasSubstr("did you mean '--iterations'?"));

  const std::string absent = Path("absent");
  for (const std::string& arguments :
       {"inspect " + absent, "unwrap " + absent, "train " + absent + " " + Path("out"),
        "evaluate " + absent + " " + absent, "render " + absent + " " + Path("out.png")}) {
    SCOPED_TRACE(arguments);
    outcome = Likeness(arguments);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_THAT(outcome.err, HasSubstr("absent"));
    EXPECT_THAT(outcome.err, HasSubstr("error: "));
  }
  EXPECT_FALSE(fs::exists(Path("out.png")));

  // A text file in place of an avatar.
  WriteFile(Path("bad.safetensors"), "this is no avatar, but it is long enough to look at\n");
  outcome = Likeness("render " + Path("bad.safetensors") + " " + Path("out.png"));
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.err, HasSubstr("bad.safetensors"));
}

TEST_F(EndToEndTest, EveryVerbExplainsItself) {
  for (const std::string verb : {"simulate", "inspect", "unwrap", "train", "evaluate", "render", "encode", "fit-arkit",
                                 "drive", "export", "bench unwrap", "bench train"}) {
    SCOPED_TRACE(verb);
    const Outcome outcome = Likeness(verb + " --help");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("example: likeness " + verb));
  }
}

}  // namespace
}  // namespace likeness
