#include "likeness/capture/convert.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/testing.h"
#include "likeness/capture/ava256/test_folder.h"
#include "likeness/capture/layout.h"
#include "likeness/capture/writer.h"
#include "likeness/image/image_io.h"
#include "likeness/image/resize.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Three cameras, of which one is held out, and six frames in three segments; textures of one size with statistics.
class ConvertTest : public ::testing::Test {
 protected:
  ConvertTest() : layout_(scratch_ / "source"), writer_(scratch_ / "source") {
    SetQuiet(true);
    for (const char* name : {"left", "mid", "right"}) {
      cameras_.push_back(
          LookAt({300.0 * static_cast<double>(cameras_.size()) - 300, 40, 1000}, {0, 0, 0}, {0, 1, 0}, 250.5, 41, 60));
      cameras_.back().name = name;
    }
    MeshTopology topology;
    topology.vertex_count = 4;
    topology.uvs = {{0, 0}, {1, 0}, {0, 1}};
    topology.triangles = {{0, 1, 2}, {0, 2, 3}};
    topology.triangle_uvs = {{0, 1, 2}, {0, 1, 2}};
    writer_.WriteCalibration(cameras_);
    writer_.WriteFrameList(frames_);
    writer_.WriteSplit({{"left", "mid"}, {"right"}, {"SEN"}});
    int seed = 0;
    for (const FrameId& frame : frames_) {
      TrackedFrame tracked;
      tracked.vertices_in_head = Vertices::Random(4, 3) * 80;
      tracked.world_from_head = {RotationFromYawPitchRoll(0.1, 0.2, 0.3), {1.0 / 3, 2, 3}};
      writer_.WriteTracked(frame, tracked);
      writer_.WriteObj(frame, tracked.vertices_in_head, topology);
      for (const Camera& camera : cameras_) {
        ImageU8 image(41, 60, 3), mask(41, 60, 1);
        for (uint8_t& v : image.values()) v = static_cast<uint8_t>(seed = (seed * 37 + 11) & 255);
        for (int y = 0; y < 60; ++y) std::fill_n(mask.at(0, y), 10 + y / 3, uint8_t{255});
        writer_.WriteImage(frame, camera.name, image);
        writer_.WriteHeadMask(frame, camera.name, mask);
        WriteFile(layout_.Texture(frame, camera.name, 32), EncodePng(ImageU8(32, 32, 3, 9)), Sync::kNo);
        WriteFile(layout_.TextureMask(frame, camera.name, 32), EncodePng(ImageU8(32, 32, 1, 255)), Sync::kNo);
      }
      WriteFile(layout_.AverageTexture(frame, 32), EncodePng(ImageU8(32, 32, 3, 9)), Sync::kNo);
    }
    WriteFile(layout_.TextureFolder(32) / "state.json", "{}");
    for (const CaptureLayout& layout : {layout_, CaptureLayout(layout_.TextureFolder(32))}) {
      for (const auto& path :
           {layout.TextureMean(), layout.TextureVariance(), layout.VertexMean(), layout.VertexVariance()}) {
        WriteFile(path, "1");
      }
    }
    source_ = OpenCapture(scratch_ / "source");
    options_.out = scratch_ / "out";
  }

  ConvertReport Convert() const { return ConvertCapture(*source_, options_); }
  std::string Failure() const {
    return ErrorOf([&] { Convert(); });
  }
  CaptureLayout out() const { return CaptureLayout(options_.out); }

  ScratchFolder scratch_;
  CaptureLayout layout_;
  CaptureWriter writer_;
  std::vector<Camera> cameras_;
  const std::vector<FrameId> frames_ = {{"EXP_a", "000010"}, {"EXP_a", "000020"}, {"EXP_a", "000030"},
                                        {"EXP_b", "000011"}, {"EXP_b", "000400"}, {"SEN_c", "000012"}};
  std::unique_ptr<Capture> source_;
  ConvertOptions options_;
};

std::vector<std::string> Names(const Capture& capture) {
  std::vector<std::string> names;
  for (const Camera& camera : capture.cameras()) names.push_back(camera.name);
  return names;
}

TEST_F(ConvertTest, AWholeCaptureIsCopiedByteForByte) {
  const ConvertReport report = Convert();
  EXPECT_EQ(report.images_copied, 18);
  EXPECT_EQ(report.images_encoded + report.images_linked + report.images_kept + report.images_absent, 0);
  EXPECT_EQ(report.masks, 18);
  EXPECT_EQ(report.textures, 2 * 18 + 6 + 1 + 2 * 4);
  EXPECT_THAT(report.dropped, IsEmpty());
  const auto copy = OpenCapture(options_.out);
  EXPECT_EQ(copy->frames(), frames_);
  EXPECT_EQ(copy->topology().triangles, source_->topology().triangles);
  EXPECT_EQ(copy->split().held_out_cameras, source_->split().held_out_cameras);
  EXPECT_EQ(copy->split().held_out_segments, source_->split().held_out_segments);
  for (size_t i = 0; i < cameras_.size(); ++i) {
    EXPECT_EQ(copy->cameras()[i].intrinsics, source_->cameras()[i].intrinsics);
    EXPECT_EQ(copy->cameras()[i].cam_from_world.translation, source_->cameras()[i].cam_from_world.translation);
  }
  for (const FrameId& frame : frames_) {
    EXPECT_EQ(copy->ReadTracked(frame).vertices_in_head, source_->ReadTracked(frame).vertices_in_head);
    EXPECT_EQ(copy->ReadTracked(frame).world_from_head.rotation, source_->ReadTracked(frame).world_from_head.rotation);
    for (const Camera& camera : cameras_) {
      EXPECT_EQ(ReadFile(out().Image(frame, camera.name)), ReadFile(layout_.Image(frame, camera.name)));
      EXPECT_EQ(copy->ReadHeadMask(frame, camera), source_->ReadHeadMask(frame, camera));
    }
  }
}

TEST_F(ConvertTest, APartTakesOnlyWhatStaysTrue) {
  options_.selection.cameras = {"right", "left"};
  options_.selection.segments = {"EXP_a", "SEN*"};
  options_.selection.frames = "10-20";
  const ConvertReport report = Convert();
  EXPECT_EQ(report.cameras, 2);
  EXPECT_EQ(report.segments, 2);
  EXPECT_EQ(report.frames, 3);
  EXPECT_THAT(report.dropped, ElementsAre("average textures and statistics: cameras are left out"));
  const auto part = OpenCapture(options_.out);
  EXPECT_THAT(Names(*part), ElementsAre("left", "right"));
  EXPECT_THAT(part->frames(), ElementsAre(frames_[0], frames_[1], frames_[5]));
  EXPECT_THAT(part->split().training_cameras, ElementsAre("left"));
  EXPECT_THAT(part->split().held_out_cameras, ElementsAre("right"));
  EXPECT_TRUE(fs::exists(out().Texture(frames_[0], "left", 32)));
  EXPECT_TRUE(fs::exists(out().TextureFolder(32) / "state.json"));
  EXPECT_FALSE(fs::exists(out().Texture(frames_[2], "left", 32)));
  EXPECT_FALSE(fs::exists(out().Texture(frames_[0], "mid", 32)));
  EXPECT_FALSE(fs::exists(out().AverageTexture(frames_[0], 32)));
  EXPECT_FALSE(fs::exists(out().TextureMean()));
  EXPECT_FALSE(fs::exists(out().Image(frames_[0], "mid")));
}

TEST_F(ConvertTest, ImagesAreMadeSmallerByAreaAndKWithThem) {
  options_.width = 20;  // of 41: no whole ratio
  const ConvertReport report = Convert();
  EXPECT_EQ(report.images_encoded, 18);
  EXPECT_EQ(report.textures, 0);
  EXPECT_THAT(report.dropped, Contains(HasSubstr("images have another size")));
  const auto smaller = OpenCapture(options_.out);
  for (const Camera& camera : smaller->cameras()) {
    ASSERT_EQ(camera.width, 20);
    ASSERT_EQ(camera.height, 29);  // 60 x 20 / 41 = 29.3
    const Camera& full = source_->FindCamera(camera.name);
    // The same point of the world lies at the same place of the picture.
    const Eigen::Vector3d point(20, -30, 10);
    const Eigen::Vector2d a = camera.Project(point), b = full.Project(point);
    EXPECT_NEAR(a.x() / 20, b.x() / 41, 1e-12);
    EXPECT_NEAR(a.y() / 29, b.y() / 60, 1e-12);
    EXPECT_EQ(smaller->ReadCameraImage(frames_[3], camera),
              ResizeArea(source_->ReadCameraImage(frames_[3], full), 20, 29));
    const auto mask = smaller->ReadHeadMask(frames_[3], camera);
    ASSERT_TRUE(mask);
    // Row 0 of the full mask is head up to x = 10 of 41, 4.9 of 20: pixel 4 is head for nine tenths, pixel 5 not.
    EXPECT_EQ(*mask->at(4, 0), 255);
    EXPECT_EQ(*mask->at(5, 0), 0);
  }
}

TEST_F(ConvertTest, LinksShareTheFile) {
  options_.link = true;
  EXPECT_EQ(Convert().images_linked, 18);
  EXPECT_TRUE(fs::equivalent(out().Image(frames_[0], "left"), layout_.Image(frames_[0], "left")));
}

TEST_F(ConvertTest, GoesOnWhereItStopped) {
  Convert();
  fs::remove(out().Image(frames_[1], "mid"));
  WriteFile(out().Image(frames_[2], "mid"), ReadFile(layout_.Image(frames_[2], "mid")).substr(0, 100));
  fs::remove(out().MeshBinary(frames_[4]));
  fs::remove(out().HeadMask(frames_[4], "left"));
  const ConvertReport report = Convert();
  EXPECT_EQ(report.images_copied, 2);
  EXPECT_EQ(report.images_kept, 16);
  EXPECT_EQ(report.masks, 1);
  EXPECT_EQ(OpenCapture(options_.out)->frames().size(), 6u);
  options_.scale = 0.5;
  EXPECT_THAT(Failure(), AllOf(HasSubstr("was converted otherwise"), HasSubstr("scale")));
}

TEST_F(ConvertTest, DamagedAndAbsentFilesAreToldAndLeftOut) {
  WriteFile(layout_.Image(frames_[0], "left"), "no picture");
  fs::remove(layout_.Image(frames_[1], "left"));
  fs::remove(layout_.HeadMask(frames_[1], "left"));
  WriteFile(layout_.MeshBinary(frames_[2]), "short");
  const ConvertReport report = Convert();
  EXPECT_EQ(report.images_copied, 16);
  EXPECT_EQ(report.images_absent, 1);
  ASSERT_EQ(report.unreadable.size(), 2u);
  EXPECT_THAT(report.unreadable, Contains(HasSubstr("000010.png: is neither PNG")));
  EXPECT_THAT(report.unreadable, Contains(HasSubstr("000030.bin: is 5 bytes long")));
  const auto copy = OpenCapture(options_.out);
  EXPECT_EQ(copy->frames().size(), 5u);
  EXPECT_FALSE(copy->HasCameraImage(frames_[0], cameras_[0]));
}

TEST_F(ConvertTest, WrongWishesAreNamed) {
  options_.selection.cameras = {"lefd"};
  EXPECT_THAT(Failure(), HasSubstr("did you mean 'left'?"));
  options_.selection.cameras = {};
  options_.selection.segments = {"EXP"};
  EXPECT_THAT(Failure(), HasSubstr("did you mean 'EXP*'?"));
  options_.selection.segments = {};
  for (const char* wrong : {"5-", "-5", "a-b", "9-3", "1-2-3", "1,2"}) {
    options_.selection.frames = wrong;
    EXPECT_THAT(Failure(), HasSubstr("FIRST-LAST")) << wrong;
  }
  options_.selection.frames = "1-2";
  EXPECT_THAT(Failure(), HasSubstr("no frame"));
  options_.selection.frames = "";
  options_.scale = 1.5;
  EXPECT_THAT(Failure(), HasSubstr("at most 1"));
  options_.scale = 0.5, options_.width = 20;
  EXPECT_THAT(Failure(), HasSubstr("not both"));
  options_.scale = 1, options_.width = 82;
  EXPECT_THAT(Failure(), HasSubstr("41 pixels wide"));
  options_.width = 0;
  options_.out = scratch_ / "source" / "part";
  EXPECT_THAT(Failure(), HasSubstr("lie in each other"));
  options_.out = scratch_.path();
  EXPECT_THAT(Failure(), HasSubstr("lie in each other"));
  options_.out = scratch_ / "full";
  WriteFile(options_.out / "KRT", "x");
  EXPECT_THAT(Failure(), HasSubstr("holds something that was not converted"));
}

TEST_F(ConvertTest, SelectionsAddUp) {
  const auto select = [&](const CaptureSelection& selection) { return SelectFrames(*source_, selection); };
  CaptureSelection selection;
  selection.every = 2;
  EXPECT_THAT(select(selection), ElementsAre(frames_[0], frames_[2], frames_[3], frames_[5]));
  selection.count = 2;
  EXPECT_THAT(select(selection), ElementsAre(frames_[0], frames_[5]));
  selection = {};
  selection.frames = "11";
  EXPECT_THAT(select(selection), ElementsAre(frames_[3]));
  // Without a training camera all that is left trains.
  EXPECT_THAT(ReduceSplit(source_->split(), {cameras_[2]}).training_cameras, ElementsAre("right"));
}

TEST_F(ConvertTest, FromAva256WithItsStatistics) {
  TestFolderOptions ava_options;
  ava_options.sensor_width = 4 * 41, ava_options.sensor_height = 4 * 60;
  const TestFolder folder(scratch_ / "ava", ava_options);
  folder.Write(*source_);
  folder.WriteTextures(*source_, 20);
  const auto ava = OpenCapture(scratch_ / "ava");
  const ConvertReport report = ConvertCapture(*ava, options_);
  EXPECT_EQ(report.images_encoded, 18);
  EXPECT_EQ(report.textures, 4);
  EXPECT_THAT(report.dropped, Contains(HasSubstr("average textures")));
  const auto copy = OpenCapture(options_.out);
  EXPECT_EQ(copy->layout_name(), "Multiface");
  EXPECT_EQ(copy->frames(), frames_);
  for (const FrameId& frame : frames_) {
    EXPECT_EQ(copy->ReadTracked(frame).vertices_in_head, source_->ReadTracked(frame).vertices_in_head);
    for (const Camera& camera : copy->cameras()) {
      EXPECT_LT((camera.intrinsics - source_->FindCamera(camera.name).intrinsics).cwiseAbs().maxCoeff(), 1e-9);
      EXPECT_EQ(copy->ReadCameraImage(frame, camera), source_->ReadCameraImage(frame, camera));
      EXPECT_EQ(copy->ReadHeadMask(frame, camera), source_->ReadHeadMask(frame, camera));
    }
  }
  EXPECT_EQ(ReadFloats(out().VertexMean()), std::vector<float>(12, 2.5f));
  options_.out = scratch_ / "part";
  options_.selection.count = 2;
  EXPECT_THAT(ConvertCapture(*ava, options_).dropped, Contains(HasSubstr("statistics: cameras or frames")));
  EXPECT_FALSE(fs::exists(out().TextureMean()));
}

}  // namespace
}  // namespace likeness
