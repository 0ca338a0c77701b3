#include "likeness/train/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/image/image_io.h"
#include "likeness/image/panels.h"
#include "likeness/train/comparison.h"
#include "likeness/train/loss_chart.h"
#include "likeness/train/run_record.h"

namespace likeness {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

EvaluatedPicture MakePicture() {
  EvaluatedPicture picture;
  picture.group = EvaluationGroup::kHeldOutCameras;
  picture.frame = {"smile", "000012"};
  picture.camera = "400<7>";
  picture.truth = ImageU8(100, 120, 3, 100);
  picture.ours = ImageU8(100, 120, 3, 116);
  picture.mask = ImageU8(100, 120, 1);
  for (int y = 40; y < 80; ++y) std::fill_n(picture.mask.at(30, y), 20, uint8_t{255});
  picture.texture = ImageU8(32, 32, 3, 60);
  picture.mse = 256;
  picture.ssim = 0.5;
  return picture;
}

// A capture that has names and nothing else.
class NamedCapture : public Capture {
 public:
  NamedCapture() {
    split_.training_cameras = {"a", "b"};
    split_.held_out_cameras = {"c"};
    split_.held_out_segments = {"talk"};
  }
  const std::filesystem::path& root() const override { return root_; }
  std::string layout_name() const override { return "none"; }
  const std::vector<Camera>& cameras() const override { return cameras_; }
  const std::vector<FrameId>& frames() const override { return frames_; }
  const std::vector<SkippedFrame>& skipped_frames() const override { return skipped_; }
  const MeshTopology& topology() const override { return topology_; }
  const Split& split() const override { return split_; }
  TrackedFrame ReadTracked(const FrameId&) const override { throw Error("none"); }
  ImageU8 ReadCameraImage(const FrameId&, const Camera&) const override { throw Error("none"); }
  bool HasCameraImage(const FrameId&, const Camera&) const override { return false; }
  bool HasHeadMask(const FrameId&, const Camera&) const override { return false; }
  std::optional<ImageU8> ReadHeadMask(const FrameId&, const Camera&) const override { return std::nullopt; }

 private:
  const std::filesystem::path root_ = "captures/<demo>";
  const std::vector<Camera> cameras_;
  const std::vector<FrameId> frames_ = {{"smile", "1"}, {"smile", "2"}, {"talk", "3"}};
  const std::vector<SkippedFrame> skipped_;
  const MeshTopology topology_;
  Split split_;
};

Avatar MakeAvatar() {
  Avatar avatar;
  avatar.architecture.texture_size = 64;
  avatar.identities[0].texture_mean = ImageF(64, 64, 3, 90);
  return avatar;
}

EvaluationResult MakeResult() {
  EvaluationResult result;
  for (size_t g = 0; g < 4; ++g) {
    result.groups[g].group = kEvaluationGroups[g];
    result.groups[g].images = 10;
    result.groups[g].error = {1000.0 * (1.0 + 2.0 * static_cast<double>(g)), 100};
    result.groups[g].ssim = 0.9;
  }
  result.groups[3].images = 0;
  result.pictures = {MakePicture()};
  return result;
}

LossLog MakeLog(int rows) {
  LossLog log;
  for (int i = 1; i <= rows; ++i) {
    log.iteration.push_back(10.0 * i);
    log.elapsed_s.push_back(i);
    for (auto* column : {&log.loss, &log.texture, &log.geometry}) column->push_back(1.0 / i);
    log.kl.push_back(i == 1 ? 0 : 0.01 * i);
    log.image.push_back(0);
  }
  return log;
}

TEST(ComparisonTest, IsCutToTheHeadAndShowsItsDifferenceInACorner) {
  const EvaluatedPicture picture = MakePicture();
  const Framing framing = HeadFraming(picture.mask);
  EXPECT_EQ(framing.width, 20 + 24);
  EXPECT_EQ(framing.height, 40 + 24);
  EXPECT_TRUE(framing.right && framing.bottom) << "all corners are alike";
  const Comparison comparison = Compare(picture, framing);
  EXPECT_EQ(comparison.truth.width(), 44);
  EXPECT_EQ(comparison.truth.height(), 64);
  EXPECT_EQ(comparison.truth.at(0, 0)[0], 100);
  EXPECT_EQ(comparison.ours.at(0, 0)[2], 116);
  // A third of each side, within its frame: head pixels in the middle, nothing beside them.
  const Colour expected = HeatColour(256 / kDifferenceFullScale);
  const uint8_t* middle = comparison.ours.at(44 - 7, 64 - 10);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(middle[c], expected[c], 1);
  EXPECT_EQ(comparison.ours.at(44 - 13, 64 - 19)[0], 0);
  EXPECT_LE(Compare(picture, framing, 30, 30).truth.height(), 30);
}

TEST(ComparisonTest, TheInsetGoesWhereTheHeadIsNot) {
  ImageU8 mask(90, 90, 1);
  for (const bool right : {false, true}) {
    for (const bool bottom : {false, true}) {
      std::fill(mask.values().begin(), mask.values().end(), uint8_t{255});
      *mask.at(right ? 80 : 10, bottom ? 80 : 10) = 0;
      for (const Framing& framing : {HeadFraming(mask), WholeFraming(mask)}) {
        EXPECT_EQ(framing.right, right);
        EXPECT_EQ(framing.bottom, bottom);
        EXPECT_EQ(framing.width, 90);
      }
    }
  }
}

TEST(ComparisonTest, PicturesAndIndexAreWritten) {
  const ScratchFolder scratch;
  EvaluatedPicture picture = MakePicture();
  picture.camera = "400007";
  const auto paths = WriteComparisons({picture}, scratch / "pictures");
  ASSERT_EQ(paths.size(), 1u);
  EXPECT_EQ(paths[0].filename(), "held_out_cameras_smile_000012_400007.png");
  EXPECT_GT(ReadImage(paths[0]).width(), 2 * 320);
  const auto index = nlohmann::json::parse(ReadFile(scratch / "pictures/index.json"));
  EXPECT_EQ(index[0]["file"], paths[0].filename().string());
  EXPECT_EQ(index[0]["group"], "held_out_cameras");
  EXPECT_NEAR(index[0]["psnr_db"], PsnrDb(256), 1e-9);
}

TEST(RunRecordTest, ReadsTheColumnsOfALogByName) {
  const ScratchFolder scratch;
  WriteFile(scratch / "log.csv",
            "kl,iteration,elapsed_s,extra,loss,texture,geometry\n3,10,1.5,x,6,1,2\n4,20,3,y,5,1,1\n");
  const LossLog log = ReadLossLog(scratch / "log.csv");
  EXPECT_THAT(log.iteration, ElementsAre(10, 20));
  EXPECT_THAT(log.elapsed_s, ElementsAre(1.5, 3));
  EXPECT_THAT(log.kl, ElementsAre(3, 4));
  EXPECT_THAT(log.geometry, ElementsAre(2, 1));
}

TEST(RunRecordTest, DamagedLogsAreRefusedWithTheirLine) {
  const ScratchFolder scratch;
  const auto error = [&](const std::string& text) {
    WriteFile(scratch / "log.csv", text);
    return ErrorOf([&] { ReadLossLog(scratch / "log.csv"); });
  };
  const std::string header = "iteration,elapsed_s,loss,texture,geometry,kl\n";
  EXPECT_EQ(error(header), "");
  EXPECT_THAT(error(""), HasSubstr("empty"));
  EXPECT_THAT(error("iteration,loss\n1,2\n"), AllOf(HasSubstr("log.csv:1"), HasSubstr("elapsed_s")));
  EXPECT_THAT(error(header + "1,2,3,4,5,6\n1,2,3\n"), AllOf(HasSubstr("log.csv:3"), HasSubstr("3 values")));
  EXPECT_THAT(error(header + "1,2,nan,4,5,6\n"), HasSubstr("log.csv:2"));
  EXPECT_THAT(error(header + "1,2,3,4,5,six\n"), HasSubstr("log.csv:2"));
  EXPECT_THAT(error(std::string("\x89PNG\r\n\x1a\n\0\0", 10)), HasSubstr("log.csv:1"));
}

TEST(RunRecordTest, ReadsStageTimes) {
  const ScratchFolder scratch;
  const auto write = [&](const std::string& text) {
    WriteFile(scratch / "times.csv", text);
    return scratch / "times.csv";
  };
  const auto stages = ReadStageTimes(write("stage,seconds\nbuild, 12.5\nsimulate,60\n\n"));
  ASSERT_EQ(stages.size(), 2u);
  EXPECT_EQ(stages[0].name, "build");
  EXPECT_EQ(stages[0].seconds, 12.5);
  for (const char* wrong : {"build\n", "build,fast\n", "build,-3\n", ",5\n", "a,b,c\n", "build,inf\n"}) {
    EXPECT_THAT(ErrorOf([&] { ReadStageTimes(write(wrong)); }), HasSubstr("times.csv:1")) << wrong;
  }
}

TEST(LossChartTest, DrawsEveryTermWithinItsFrame) {
  const std::string svg = LossChart(MakeLog(1000));
  for (const char* part : {"line-0", "line-1", "line-2", "line-3", "texture", "KL", "iterations"}) {
    EXPECT_THAT(svg, HasSubstr(part));
  }
  EXPECT_THAT(svg, AllOf(Not(HasSubstr("nan")), Not(HasSubstr("inf"))));
  EXPECT_LT(svg.size(), 30000u);
  EXPECT_THAT(LossChart(MakeLog(1)), IsEmpty());
  LossLog zeros = MakeLog(5);
  for (auto* column : {&zeros.loss, &zeros.texture, &zeros.geometry, &zeros.kl, &zeros.image})
    std::fill(column->begin(), column->end(), 0);
  EXPECT_THAT(LossChart(zeros), IsEmpty());
}

TEST(LossChartTest, ThinningTakesMeans) {
  EXPECT_THAT(Thinned({1, 3, 5, 7}, 2), ElementsAre(2, 6));
  EXPECT_THAT(Thinned({1, 2}, 5), ElementsAre(1, 2));
}

TEST(ReportTest, HoldsEverythingAndNeedsNothing) {
  const NamedCapture capture;
  const Avatar avatar = MakeAvatar();
  const EvaluationResult result = MakeResult();
  const std::string html =
      ReportHtml({"out/avatar.safetensors", avatar, capture, result, MakeLog(50), {{"train", 61}, {"build", 3}}});
  for (const char* part : {"Held-out cameras", "ground truth", "mean texture", "decoded texture", "<svg", "1 min 01 s",
                           "What to try next", "prefers-color-scheme: dark", "400&lt;7&gt;", "captures/&lt;demo&gt;"}) {
    EXPECT_THAT(html, HasSubstr(part));
  }
  for (const char* part : {"http:", "https:", "<script", "url(", "400<7>"}) EXPECT_THAT(html, Not(HasSubstr(part)));
  // Four pictures: truth, ours with the difference, two textures.
  int pictures = 0;
  for (size_t at = html.find("data:image/jpeg"); at != std::string::npos; at = html.find("data:image/jpeg", at + 1))
    ++pictures;
  EXPECT_EQ(pictures, 4);
}

TEST(ReportTest, SaysNothingOfWhatItDoesNotKnow) {
  const NamedCapture capture;
  const Avatar avatar = MakeAvatar();
  EvaluationResult result = MakeResult();
  result.pictures.clear();
  const std::string html = ReportHtml({"avatar", avatar, capture, result, std::nullopt, {}});
  for (const char* part : {"<img", "<svg", "<h2>Time", "<h2>Textures", "nan", "inf "}) {
    EXPECT_THAT(html, Not(HasSubstr(part)));
  }
}

TEST(ReportTest, AdviceFollowsTheFigures) {
  const NamedCapture capture;
  Avatar avatar = MakeAvatar();
  EvaluationResult result = MakeResult();
  const auto advice = [&](const std::optional<LossLog>& log) {
    std::string all;
    for (const std::string& sentence : Advice({"a", avatar, capture, result, log, {}})) all += sentence + "\n";
    return all;
  };
  // MSE of 10, 30 and 50: 4.8 dB and 7 dB apart.
  EXPECT_THAT(advice(MakeLog(30)), AllOf(HasSubstr("had 300"), HasSubstr("4.8 dB"), HasSubstr("7.0 dB"),
                                         HasSubstr("--size 128"), Not(HasSubstr("outside the mesh"))));
  result.groups[1].error = result.groups[2].error = result.groups[0].error;
  result.groups[2].uncovered = 0.034;
  avatar.architecture.texture_size = 1024;
  EXPECT_THAT(advice(std::nullopt),
              AllOf(Not(HasSubstr("dB")), Not(HasSubstr("--size")), HasSubstr("3.4 %"), HasSubstr("likeness render")));
}

TEST(ReportTest, Base64OfKnownBytes) {
  EXPECT_EQ(Base64(""), "");
  EXPECT_EQ(Base64("f"), "Zg==");
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foo"), "Zm9v");
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Base64("\xff\xfe\xfd"), "//79");
  EXPECT_EQ(EscapeHtml("<a href=\"x\">&"), "&lt;a href=&quot;x&quot;&gt;&amp;");
}

}  // namespace
}  // namespace likeness
