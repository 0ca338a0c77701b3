#include "likeness/texture/unwrap_capture.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/parallel.h"
#include "likeness/base/testing.h"
#include "likeness/capture/writer.h"
#include "likeness/image/image_io.h"
#include "likeness/texture/test_scene.h"
#include "likeness/texture/texture_set.h"
#include "likeness/texture/texture_sums.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kSize = 32;

// Three cameras (the middle one held out), two training frames and one of a held-out segment.
class UnwrapCaptureTest : public ::testing::Test {
 protected:
  UnwrapCaptureTest() : writer_(scratch_ / "capture"), cameras_(TestCameras(3, 60, 50)) {
    frames_ = {{"E1", "000003"}, {"E1", "000007"}, {"EXP_1", "000009"}};
    writer_.WriteCalibration(cameras_);
    writer_.WriteFrameList(frames_);
    Split split;
    split.training_cameras = {"cam0", "cam2"};
    split.held_out_cameras = {"cam1"};
    split.held_out_segments = {"EXP"};
    writer_.WriteSplit(split);
    for (size_t i = 0; i < frames_.size(); ++i) {
      const TestHead head(15 + 5 * static_cast<double>(i));
      writer_.WriteTracked(frames_[i], {head.vertices, TestPose()});
      if (i == 0) writer_.WriteObj(frames_[i], head.vertices, head.topology);
      for (const Camera& camera : cameras_) {
        const TestPicture picture = DrawTestHead(head, camera, TestPose(), 0.2 * static_cast<double>(i));
        writer_.WriteImage(frames_[i], camera.name, picture.image);
        writer_.WriteHeadMask(frames_[i], camera.name, picture.mask);
      }
    }
    options_.size = kSize;
    SetQuiet(true);
    Open();
  }

  void Open(const CaptureOptions& options = {}) { capture_ = OpenCapture(scratch_ / "capture", options); }
  const CaptureLayout& layout() const { return writer_.layout(); }
  std::string UnwrapError() const {
    return ErrorOf([&] { UnwrapCapture(*capture_, options_); });
  }

  // All files of the textures and statistics with their bytes.
  std::map<std::string, std::string> Outputs() const {
    std::map<std::string, std::string> outputs;
    for (const auto& entry : fs::recursive_directory_iterator(capture_->root())) {
      const std::string name = entry.path().lexically_relative(capture_->root()).string();
      if (entry.is_regular_file() &&
          (name.starts_with("unwrapped_") || name.starts_with("tex_") || name.starts_with("vert_"))) {
        outputs[name] = ReadFile(entry.path());
      }
    }
    return outputs;
  }

  ScratchFolder scratch_;
  CaptureWriter writer_;
  std::vector<Camera> cameras_;
  std::vector<FrameId> frames_;
  UnwrapOptions options_;
  std::unique_ptr<Capture> capture_;
};

TEST_F(UnwrapCaptureTest, WritesTexturesAveragesAndStatisticsOfTrainingViewsAlone) {
  const UnwrapReport report = UnwrapCapture(*capture_, options_);
  EXPECT_EQ(report.views, 9);
  EXPECT_EQ(report.training_views, 4);
  const TextureSet textures(*capture_, kSize);
  TextureSums total(kSize);
  VertexSums vertices;
  for (const FrameId& frame : frames_) {
    TextureSums sums(kSize);
    for (const Camera& camera : cameras_) {
      ASSERT_TRUE(textures.HasTexture(frame, camera.name));
      const UnwrappedView view = {textures.ReadTexture(frame, camera.name), textures.ReadMask(frame, camera.name)};
      const TrackedFrame tracked = capture_->ReadTracked(frame);
      const FrameUnwrapper unwrapper(capture_->topology(), MapTexels(capture_->topology(), kSize),
                                     tracked.vertices_in_head, options_);
      const ImageU8 mask = *capture_->ReadHeadMask(frame, camera);
      const UnwrappedView expected =
          unwrapper.Unwrap(capture_->FindCamera(camera.name), tracked.world_from_head,
                           capture_->ReadCameraImage(frame, capture_->FindCamera(camera.name)), &mask);
      EXPECT_EQ(view.texture, expected.texture);
      EXPECT_EQ(view.mask, expected.mask);
      if (camera.name != "cam1") sums.Add(view);
    }
    EXPECT_EQ(textures.ReadAverage(frame), sums.Average());
    if (frame.segment == "EXP_1") continue;
    total.Add(sums);
    vertices.Add(capture_->ReadTracked(frame).vertices_in_head);
  }
  const TextureStatistics statistics = textures.ReadStatistics();
  ImageF mean(kSize, kSize, 3);
  const ImageU8 filled = total.FilledAverage();
  std::copy(filled.values().begin(), filled.values().end(), mean.values().begin());
  EXPECT_EQ(statistics.mean, mean);
  EXPECT_EQ(statistics.variance, total.Variance());
  EXPECT_EQ(statistics.vertex_mean, vertices.Mean());
  EXPECT_EQ(statistics.vertex_variance, vertices.Variance());
  EXPECT_GT(statistics.vertex_variance, 0);
  EXPECT_EQ(report.texture_variance, statistics.variance);
  EXPECT_EQ(ReadImage(layout().TextureMean()), filled);
}

TEST_F(UnwrapCaptureTest, TheSameForAnyNumberOfThreadsAndInterruptions) {
  SetThreadCount(1);
  UnwrapCapture(*capture_, options_);
  const auto expected = Outputs();
  SetThreadCount(3);
  options_.redo = true;
  EXPECT_EQ(UnwrapCapture(*capture_, options_).views, 9);
  EXPECT_EQ(Outputs(), expected);
  SetThreadCount(0);

  options_.redo = false;
  UnwrapReport report = UnwrapCapture(*capture_, options_);
  EXPECT_EQ(report.views, 0);
  EXPECT_EQ(report.views_kept, 9);
  EXPECT_EQ(Outputs(), expected);

  // As an interruption or a crash may leave it: files absent, cut off, empty, and no statistics.
  fs::remove(layout().Texture(frames_[0], "cam0", kSize));
  fs::resize_file(layout().Texture(frames_[1], "cam1", kSize), 100);
  fs::resize_file(layout().TextureMask(frames_[1], "cam2", kSize), 0);
  fs::remove(layout().AverageTexture(frames_[2], kSize));
  fs::remove(layout().TextureFolder(kSize) / "tex_mean.png");
  report = UnwrapCapture(*capture_, options_);
  EXPECT_EQ(report.views, 3);
  EXPECT_EQ(report.views_kept, 6);
  EXPECT_EQ(Outputs(), expected);
}

TEST_F(UnwrapCaptureTest, AnotherSplitRemakesAveragesAndStatisticsOnly) {
  UnwrapCapture(*capture_, options_);
  auto before = Outputs();
  CaptureOptions other;
  other.split_file = scratch_ / "other.json";
  WriteFile(other.split_file, R"({"full": {"train": ["cam0", "cam1"], "test": ["cam2"]}, "segment": ["EXP"]})");
  Open(other);
  const UnwrapReport report = UnwrapCapture(*capture_, options_);
  EXPECT_EQ(report.views, 0);
  for (const auto& [name, bytes] : Outputs()) {
    const bool remade = name.find("average") != std::string::npos || name.find("tex_") != std::string::npos ||
                        name.ends_with("state.json");
    EXPECT_EQ(bytes != before[name], remade) << name;
  }
  const TextureSet textures(*capture_, kSize);
  TextureSums sums(kSize);
  for (const char* camera : {"cam0", "cam1"}) {
    sums.Add({textures.ReadTexture(frames_[0], camera), textures.ReadMask(frames_[0], camera)});
  }
  EXPECT_EQ(textures.ReadAverage(frames_[0]), sums.Average());
}

TEST_F(UnwrapCaptureTest, HeldOutCamerasCanBeLeftOutAndImagesCanBeAbsent) {
  options_.held_out = false;
  fs::remove(layout().Image(frames_[1], "cam2"));
  const UnwrapReport report = UnwrapCapture(*capture_, options_);
  EXPECT_EQ(report.views, 5);
  EXPECT_EQ(report.views_absent, 1);
  EXPECT_EQ(report.training_views, 3);
  EXPECT_FALSE(TextureSet(*capture_, kSize).HasTexture(frames_[0], "cam1"));
  fs::remove_all(capture_->root() / "images");
  options_.redo = true;
  EXPECT_THAT(UnwrapError(), HasSubstr("no training camera has an image of a training frame"));
}

TEST_F(UnwrapCaptureTest, PixelsThatAreNotValidGiveNoColour) {
  // The left half of cam0 is valid; without masks of heads too.
  ImageU8 valid(60, 50, 1);
  for (int y = 0; y < 50; ++y) std::fill_n(valid.row(y), 30, 255);
  writer_.WriteValidMask("cam0", valid);
  const TestHead head(15);
  const FrameUnwrapper unwrapper(head.topology, MapTexels(head.topology, kSize), head.vertices, options_);
  const Camera& camera = capture_->FindCamera("cam0");
  const ImageU8 image = capture_->ReadCameraImage(frames_[0], camera);
  for (const bool use_masks : {true, false}) {
    ImageU8 both = valid;
    const ImageU8 head_mask = *capture_->ReadHeadMask(frames_[0], camera);
    for (size_t i = 0; use_masks && i < both.values().size(); ++i) both.values()[i] &= head_mask.values()[i];
    options_.use_masks = use_masks;
    options_.redo = true;
    UnwrapCapture(*capture_, options_);
    const UnwrappedView expected = unwrapper.Unwrap(camera, TestPose(), image, &both);
    EXPECT_EQ(TextureSet(*capture_, kSize).ReadMask(frames_[0], "cam0"), expected.mask);
    EXPECT_NE(expected.mask, unwrapper.Unwrap(camera, TestPose(), image, nullptr).mask);
  }
}

TEST_F(UnwrapCaptureTest, TexturesOfOtherMakingAreNotTouched) {
  UnwrapCapture(*capture_, options_);
  const auto before = Outputs();
  options_.grazing_deg = 60;
  EXPECT_THAT(UnwrapError(), AllOf(HasSubstr("other options"), HasSubstr("--redo")));
  EXPECT_EQ(Outputs(), before);
  WriteFile(layout().TextureFolder(kSize) / "state.json", "{");
  EXPECT_THAT(UnwrapError(), AllOf(HasSubstr("state.json"), HasSubstr("damaged")));
  fs::remove(layout().TextureFolder(kSize) / "state.json");
  EXPECT_THAT(UnwrapError(), HasSubstr("another program made"));
  options_.redo = true;
  UnwrapCapture(*capture_, options_);
  EXPECT_NE(Outputs(), before);
}

TEST_F(UnwrapCaptureTest, TheRootKeepsStatisticsThatExistNowhereElse) {
  const auto root_size = [&] { return ReadImageInfo(layout().TextureMean()).width; };
  UnwrapCapture(*capture_, options_);
  EXPECT_EQ(root_size(), 32);
  options_.size = 64;
  UnwrapCapture(*capture_, options_);
  EXPECT_EQ(root_size(), 64);
  options_.size = 16;
  UnwrapCapture(*capture_, options_);
  EXPECT_EQ(root_size(), 64);
  // Published statistics: in the root alone.
  WritePng(layout().TextureMean(), ImageU8(48, 48, 3, 7));
  options_.size = 64;
  options_.redo = true;
  UnwrapCapture(*capture_, options_);
  EXPECT_EQ(root_size(), 48);
  EXPECT_EQ(TextureSet(*capture_, 64).ReadStatistics().mean.width(), 64);
  EXPECT_EQ(TextureSizes(capture_->root()), (std::vector{16, 32, 64}));
}

TEST_F(UnwrapCaptureTest, TextureSetsReadPublishedTexturesAndNameWhatIsWrong) {
  EXPECT_THAT(ErrorOf([&] { TextureSet(*capture_, 128); }),
              AllOf(HasSubstr("no textures of 128 x 128"), HasSubstr("there are none"), HasSubstr("--size 128")));
  UnwrapCapture(*capture_, options_);
  EXPECT_THAT(ErrorOf([&] { TextureSet(*capture_, 128); }), HasSubstr("there are 32;"));
  const TextureSet textures(*capture_, kSize);
  const ImageU8 mask = textures.ReadMask(frames_[0], "cam0");
  fs::remove_all(layout().TextureMaskFolder(kSize));
  EXPECT_EQ(textures.ReadMask(frames_[0], "cam0"), mask);  // from texels that are 0

  WritePng(layout().Texture(frames_[0], "cam0", kSize), ImageU8(8, 8, 3));
  EXPECT_THAT(ErrorOf([&] { textures.ReadTexture(frames_[0], "cam0"); }), HasSubstr("8 x 8 texels; expected 32 x 32"));
  for (const std::string text : {"", "0\n", "-3", "nan", "1 2", "x"}) {
    WriteFile(layout().TextureFolder(kSize) / "tex_var.txt", text);
    EXPECT_THAT(ErrorOf([&] { textures.ReadStatistics(); }), HasSubstr("tex_var.txt")) << text;
  }
  fs::remove(layout().TextureFolder(kSize) / "tex_mean.png");
  EXPECT_EQ(textures.ReadStatistics().mean.width(), kSize);  // the root's
  WriteFile(layout().VertexMean(), "abc");
  EXPECT_THAT(ErrorOf([&] { textures.ReadStatistics(); }), HasSubstr("vert_mean.bin"));
  fs::remove(layout().TextureMean());
  EXPECT_THAT(ErrorOf([&] { textures.ReadStatistics(); }), HasSubstr("likeness unwrap"));
}

TEST_F(UnwrapCaptureTest, ShardsAddUpToTheWholeBitForBit) {
  UnwrapCapture(*capture_, options_);
  const std::map<std::string, std::string> whole = Outputs();
  const auto clear = [&] {
    fs::remove_all(layout().TextureFolder(kSize));
    fs::remove_all(layout().TextureMaskFolder(kSize));
    fs::remove(layout().TextureMean());
  };
  for (const int count : {2, 3, 5}) {
    clear();
    for (int index = count; index >= 1; --index) {
      SCOPED_TRACE(fmt::format("shard {} of {}", index, count));
      EXPECT_FALSE(fs::exists(layout().TextureMean()));
      const UnwrapReport report = UnwrapCapture(*capture_, options_, {index, count});
      EXPECT_EQ(report.shards_missing.size(), static_cast<size_t>(index - 1));
      EXPECT_EQ(report.texture_variance > 0, index == 1);
      EXPECT_EQ(report.training_views, 4);
    }
    std::map<std::string, std::string> outputs = Outputs();
    outputs.erase("unwrapped_uv_32/.lock");
    EXPECT_EQ(outputs, whole);
    // Once more: nothing is left to do.
    const UnwrapReport again = UnwrapCapture(*capture_, options_, {1, count});
    EXPECT_EQ(again.views, 0);
    EXPECT_GT(again.texture_variance, 0);
  }
}

TEST_F(UnwrapCaptureTest, AShardThatWasLostRunsAgain) {
  UnwrapCapture(*capture_, options_, {1, 3});
  UnwrapCapture(*capture_, options_, {2, 3});
  // The second one loses a texture and its sums; the third one never ran.
  fs::remove(layout().Texture(frames_[1], "cam0", kSize));
  for (const std::string& name : ListFolder(layout().TextureFolder(kSize) / ".sums")) {
    if (name.starts_with("2-")) fs::remove(layout().TextureFolder(kSize) / ".sums" / name);
  }
  EXPECT_EQ(UnwrapCapture(*capture_, options_, {3, 3}).shards_missing, std::vector<int>{2});
  const UnwrapReport report = UnwrapCapture(*capture_, options_, {2, 3});
  EXPECT_EQ(report.views, 1);
  EXPECT_EQ(report.views_kept, 2);
  EXPECT_TRUE(report.shards_missing.empty());
  std::map<std::string, std::string> shards = Outputs();
  shards.erase("unwrapped_uv_32/.lock");
  options_.redo = true;
  EXPECT_THAT(ErrorOf([&] { UnwrapCapture(*capture_, options_, {1, 2}); }), HasSubstr("--redo"));
  UnwrapCapture(*capture_, options_);
  EXPECT_EQ(Outputs(), shards);
}

TEST_F(UnwrapCaptureTest, ADamagedSumIsNamed) {
  UnwrapCapture(*capture_, options_, {1, 2});
  const fs::path folder = layout().TextureFolder(kSize) / ".sums";
  ASSERT_EQ(ListFolder(folder).size(), 1u);
  const fs::path path = folder / ListFolder(folder)[0];
  const std::string bytes = ReadFile(path);
  const TextureSums read = TextureSums::Parse(path, bytes, kSize);
  EXPECT_EQ(read.Bytes(), bytes);
  EXPECT_EQ(read.views(), 2);
  EXPECT_THAT(ErrorOf([&] { TextureSums::Parse(path, bytes, 2 * kSize); }), HasSubstr("no sum of textures"));
  for (const size_t length : {size_t{0}, size_t{10}, size_t{30}, bytes.size() - 1}) {
    EXPECT_THAT(ErrorOf([&] { TextureSums::Parse(path, bytes.substr(0, length), kSize); }), HasSubstr(path.string()));
  }
  std::string wrong = bytes;
  wrong.back() = '\x7f';
  EXPECT_THAT(ErrorOf([&] { TextureSums::Parse(path, wrong, kSize); }), HasSubstr("damaged"));
  WriteFile(path, bytes.substr(1));
  EXPECT_THAT(ErrorOf([&] { UnwrapCapture(*capture_, options_, {2, 2}); }), HasSubstr("run shard 1/2 again"));
  fs::remove(path);
  EXPECT_EQ(UnwrapCapture(*capture_, options_, {1, 2}).shards_missing.size(), 0u);
}

}  // namespace
}  // namespace likeness
