#include "likeness/capture/capture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/capture/layout.h"
#include "likeness/capture/writer.h"
#include "likeness/geometry/obj.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> Names(const std::vector<Camera>& cameras) {
  std::vector<std::string> names;
  for (const Camera& camera : cameras) names.push_back(camera.name);
  return names;
}

// Three cameras, four frames in two segments, a mesh of two triangles with an unused vertex and fewer uvs than
// vertices.
class CaptureTest : public ::testing::Test {
 protected:
  CaptureTest() : writer_(scratch_ / "m--20260101--0000--0000001--GHS") {
    for (int i = 0; i < 3; ++i) {
      cameras_.push_back(
          LookAt({300.0 * i - 290.123456789, 77.7, 1000.0 + i}, {0, 0, 0}, {0, 1, 0}, 1234.5678 / 3, 40, 30));
      cameras_.back().name = std::vector<std::string>{"400002", "400010", "left"}[static_cast<size_t>(i)];
    }
    frames_ = {{"E1_Neutral", "000012"}, {"E1_Neutral", "000019"}, {"EXP_ROM_7", "000020"}, {"EXP_ROM_7", "010000"}};
    topology_.vertex_count = 5;
    topology_.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    topology_.triangles = {{0, 1, 2}, {0, 2, 4}};  // vertex 3 belongs to no face
    topology_.triangle_uvs = {{0, 1, 2}, {0, 2, 3}};
    split_.training_cameras = {"400002", "left"};
    split_.held_out_cameras = {"400010"};
    split_.held_out_segments = {"EXP_ROM"};
  }

  TrackedFrame Tracked(int index) const {
    TrackedFrame tracked;
    tracked.vertices_in_head.resize(5, 3);
    tracked.vertices_in_head << 0, 0, 0, 1, 0, 0, 1, 1, 0.1f, 9, 9, 9, 0, 1, static_cast<float>(index);
    tracked.world_from_head = {RotationFromYawPitchRoll(0.1 * index, 0.2, 0.3), {1.0 / 3, 2, 3.0 * index}};
    return tracked;
  }

  ImageU8 Picture(int seed) const {
    ImageU8 image(40, 30, 3);
    int value = seed;
    for (uint8_t& v : image.values()) v = static_cast<uint8_t>(value = (value * 37 + 11) & 255);
    return image;
  }

  void WriteAll() const {
    writer_.WriteCalibration(cameras_);
    writer_.WriteFrameList(frames_);
    writer_.WriteSplit(split_);
    for (size_t i = 0; i < frames_.size(); ++i) {
      writer_.WriteTracked(frames_[i], Tracked(static_cast<int>(i)));
      for (const Camera& camera : cameras_) writer_.WriteImage(frames_[i], camera.name, Picture(static_cast<int>(i)));
    }
    // Not head-aligned, as in a published sample.
    const Vertices elsewhere = Vertices::Constant(5, 3, 1000);
    writer_.WriteObj(frames_[2], elsewhere, topology_);
  }

  const CaptureLayout& layout() const { return writer_.layout(); }
  std::filesystem::path root() const { return layout().Calibration().parent_path(); }
  std::string OpenError(const CaptureOptions& options = {}) const {
    return ErrorOf([&] { OpenCapture(root(), options); });
  }

  ScratchFolder scratch_;
  CaptureWriter writer_;
  std::vector<Camera> cameras_;
  std::vector<FrameId> frames_;
  MeshTopology topology_;
  Split split_;
};

TEST_F(CaptureTest, WhatIsWrittenIsReadBack) {
  WriteAll();
  writer_.WriteHeadMask(frames_[1], "left", ImageU8(40, 30, 1, 255));
  const auto capture = OpenCapture(root());
  EXPECT_EQ(capture->layout_name(), "Multiface");
  ASSERT_EQ(capture->cameras().size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    const Camera& read = capture->cameras()[i];
    EXPECT_EQ(read.name, cameras_[i].name);
    EXPECT_EQ(read.width, 40);
    EXPECT_EQ(read.height, 30);
    EXPECT_EQ(read.intrinsics, cameras_[i].intrinsics);  // bit for bit
    EXPECT_EQ(read.cam_from_world.rotation, cameras_[i].cam_from_world.rotation);
    EXPECT_EQ(read.cam_from_world.translation, cameras_[i].cam_from_world.translation);
  }
  EXPECT_EQ(capture->frames(), frames_);
  EXPECT_THAT(capture->skipped_frames(), IsEmpty());
  EXPECT_EQ(capture->topology().vertex_count, 5);
  EXPECT_EQ(capture->topology().uvs, topology_.uvs);
  EXPECT_EQ(capture->topology().triangles, topology_.triangles);
  EXPECT_EQ(capture->topology().triangle_uvs, topology_.triangle_uvs);
  for (size_t i = 0; i < frames_.size(); ++i) {
    const TrackedFrame read = capture->ReadTracked(frames_[i]), written = Tracked(static_cast<int>(i));
    EXPECT_EQ(read.vertices_in_head, written.vertices_in_head);
    EXPECT_EQ(read.world_from_head.rotation, written.world_from_head.rotation);
    EXPECT_EQ(read.world_from_head.translation, written.world_from_head.translation);
    EXPECT_EQ(capture->ReadCameraImage(frames_[i], cameras_[0]), Picture(static_cast<int>(i)));
  }
  EXPECT_EQ(capture->ReadHeadMask(frames_[1], capture->FindCamera("left")), ImageU8(40, 30, 1, 255));
  EXPECT_EQ(capture->ReadHeadMask(frames_[0], capture->FindCamera("left")), std::nullopt);
}

TEST_F(CaptureTest, SplitsPartCamerasByNameAndSegmentsByPrefix) {
  WriteAll();
  const auto capture = OpenCapture(root());
  EXPECT_THAT(Names(capture->TrainingCameras()), ElementsAre("400002", "left"));
  EXPECT_THAT(Names(capture->HeldOutCameras()), ElementsAre("400010"));
  EXPECT_THAT(capture->TrainingFrames(), ElementsAre(frames_[0], frames_[1]));
  EXPECT_THAT(capture->HeldOutFrames(), ElementsAre(frames_[2], frames_[3]));
  EXPECT_TRUE(capture->split().IsHeldOutCamera("400010"));
  EXPECT_FALSE(capture->split().IsHeldOutSegment("E1_EXP_ROM"));
}

TEST_F(CaptureTest, EverythingTrainsWithoutASplitAndInPublishedSplits) {
  WriteAll();
  std::filesystem::remove(layout().SplitFile());
  EXPECT_EQ(OpenCapture(root())->TrainingCameras().size(), 3u);
  EXPECT_EQ(OpenCapture(root())->TrainingFrames(), frames_);
  Split all;
  all.training_cameras = {"400002", "400010", "left"};
  writer_.WriteSplit(all);
  EXPECT_THAT(ReadFile(layout().SplitFile()), HasSubstr("\"test\""));
  EXPECT_EQ(OpenCapture(root())->TrainingCameras().size(), 3u);
  EXPECT_THAT(OpenCapture(root())->HeldOutCameras(), IsEmpty());
}

TEST_F(CaptureTest, SplitAndTestSegmentsCanBeFilesOfTheirOwn) {
  WriteAll();
  CaptureOptions options;
  options.split_file = scratch_ / "mini.json";
  options.test_segments_file = scratch_ / "segments.json";
  WriteFile(options.split_file,
            R"({"full": {"train": ["left", "elsewhere"], "test": ["left", "400002"], "visual": []}})");
  WriteFile(options.test_segments_file, R"({"segment": ["E1"]})");
  const auto capture = OpenCapture(root(), options);
  EXPECT_THAT(Names(capture->TrainingCameras()), ElementsAre("left"));
  EXPECT_THAT(Names(capture->HeldOutCameras()), ElementsAre("400002"));
  EXPECT_THAT(capture->HeldOutFrames(), ElementsAre(frames_[0], frames_[1]));
}

TEST_F(CaptureTest, AbsentAndRepeatedFramesAreSkippedAndTold) {
  WriteAll();
  std::filesystem::remove(layout().MeshBinary(frames_[0]));
  std::filesystem::remove(layout().HeadPose(frames_[3]));
  std::ofstream(layout().FrameList(), std::ios::app) << "NoSuch_segment 000001\n\n"
                                                     << "E1_Neutral 000019\n";
  const auto capture = OpenCapture(root());
  EXPECT_THAT(capture->frames(), ElementsAre(frames_[1], frames_[2]));
  std::string reasons;
  for (const SkippedFrame& skipped : capture->skipped_frames()) reasons += skipped.reason + "\n";
  EXPECT_EQ(reasons,
            "tracked_mesh/E1_Neutral/000012.bin is absent\n"
            "tracked_mesh/EXP_ROM_7/010000_transform.txt is absent\n"
            "tracked_mesh/NoSuch_segment/000001.bin is absent\n"
            "is listed twice\n");
}

TEST_F(CaptureTest, CalibrationMayGiveSizesAndImagesMayBeAbsent) {
  WriteAll();
  std::filesystem::remove_all(root() / "images" / "E1_Neutral" / "left");
  std::filesystem::remove_all(root() / "images" / "EXP_ROM_7" / "left");
  std::filesystem::remove_all(root() / "images" / "E1_Neutral" / "400010");
  auto capture = OpenCapture(root());
  EXPECT_EQ(capture->FindCamera("left").width, 0);
  EXPECT_EQ(capture->FindCamera("400010").width, 40);
  EXPECT_FALSE(capture->HasCameraImage(frames_[0], cameras_[1]));
  EXPECT_TRUE(capture->HasCameraImage(frames_[2], cameras_[1]));

  std::string krt = ReadFile(layout().Calibration());
  krt.replace(krt.find("left"), 4, "left 640 480");
  WriteFile(layout().Calibration(), krt);
  capture = OpenCapture(root());
  EXPECT_EQ(capture->FindCamera("left").width, 640);
  EXPECT_EQ(capture->FindCamera("left").height, 480);
}

TEST_F(CaptureTest, TopologyCanBeAFileOfItsOwn) {
  WriteAll();
  std::filesystem::remove(layout().MeshObj(frames_[2]));
  EXPECT_THAT(OpenError(), AllOf(HasSubstr("tracked_mesh"), HasSubstr("--topology")));
  CaptureOptions options;
  options.topology_file = scratch_ / "face.obj";
  likeness::WriteObj(options.topology_file, Vertices::Zero(5, 3), topology_);
  EXPECT_EQ(OpenCapture(root(), options)->topology().triangles, topology_.triangles);
  WriteFile(options.topology_file, "v 0 0 0\nv 1 0 0\n");
  EXPECT_THAT(OpenError(options), AllOf(HasSubstr("face.obj"), HasSubstr("has no faces")));
}

TEST_F(CaptureTest, WrongFilesAreNamed) {
  WriteAll();
  const auto capture = OpenCapture(root());
  WriteFile(layout().MeshBinary(frames_[0]), std::string(56, '\0'));
  EXPECT_THAT(ErrorOf([&] { capture->ReadTracked(frames_[0]); }),
              AllOf(HasSubstr("E1_Neutral/000012.bin"), HasSubstr("expected 15 float32 values")));
  std::vector<float> values(15, 0);
  values[7] = std::numeric_limits<float>::quiet_NaN();
  WriteFloats(layout().MeshBinary(frames_[0]), values);
  EXPECT_THAT(ErrorOf([&] { capture->ReadTracked(frames_[0]); }), HasSubstr("value 7 is not a finite number"));
  WriteFile(layout().HeadPose(frames_[1]), "1 0 0 0\n0 1 0 0\n");
  EXPECT_THAT(ErrorOf([&] { capture->ReadTracked(frames_[1]); }), HasSubstr("000019_transform.txt:2: the file ends"));
  WritePng(layout().Image(frames_[0], "left"), ImageU8(30, 40, 3));
  EXPECT_THAT(ErrorOf([&] { capture->ReadCameraImage(frames_[0], capture->FindCamera("left")); }),
              HasSubstr("is 30 x 40 pixels, but camera left has 40 x 30"));
  WriteFile(layout().Image(frames_[1], "left"), "no picture");
  EXPECT_THAT(ErrorOf([&] { capture->ReadCameraImage(frames_[1], capture->FindCamera("left")); }),
              HasSubstr("000019.png: is neither PNG nor JPEG"));
  EXPECT_THAT(ErrorOf([&] { capture->FindCamera("lefd"); }), HasSubstr("did you mean 'left'?"));
}

TEST_F(CaptureTest, WrongCapturesAreNamed) {
  EXPECT_THAT(OpenError(), HasSubstr("no such folder"));
  writer_.WriteCalibration(cameras_);
  EXPECT_THAT(OpenError(), HasSubstr("is no capture: expected the Multiface layout"));
  writer_.WriteFrameList(frames_);
  EXPECT_THAT(OpenError(), AllOf(HasSubstr("none of its 4 frames has a tracked mesh"), HasSubstr("000012.bin")));
  WriteAll();
  CaptureOptions options;
  options.split_file = scratch_ / "none.json";
  EXPECT_THAT(OpenError(options), HasSubstr("none.json: no such file"));
  WriteFile(options.split_file, R"({"full": {"train": ["right"], "test": []}})");
  EXPECT_THAT(OpenError(options),
              AllOf(HasSubstr("none of its 1 training cameras"), HasSubstr("400002, 400010, left")));
}

TEST_F(CaptureTest, NamesThatTheLayoutCannotHoldAreRefused) {
  const std::string expected = "cannot be the name of";
  for (const std::string name : {"", "a b", "a/b", "..", ".x", "average", "a\nb", "\xff"}) {
    EXPECT_THAT(ErrorOf([&] { writer_.WriteFrameList({{"E1", name}}); }), HasSubstr(expected)) << name;
    cameras_[0].name = name;
    EXPECT_THAT(ErrorOf([&] { writer_.WriteCalibration(cameras_); }), HasSubstr(expected)) << name;
    EXPECT_THAT(ErrorOf([&] { writer_.WriteImage(frames_[0], name, Picture(0)); }), HasSubstr(expected)) << name;
  }
  cameras_[0].name = cameras_[1].name;
  EXPECT_THAT(ErrorOf([&] { writer_.WriteCalibration(cameras_); }), HasSubstr("two cameras"));
}

}  // namespace
}  // namespace likeness
