#include "likeness/simulate/simulate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/parallel.h"
#include "likeness/base/testing.h"
#include "likeness/capture/layout.h"
#include "likeness/image/image_io.h"
#include "likeness/simulate/open_head.h"

namespace likeness {
namespace {

using ::testing::HasSubstr;

SimulateOptions TinyOptions(const std::filesystem::path& out) {
  SetQuiet(true);
  SimulateOptions options;
  options.out = out;
  options.head = "procedural";
  options.frames = 3;
  options.rig.cameras = 3;
  options.rig.held_out_cameras = 1;
  options.rig.width = 64;
  options.rig.height = 96;
  options.render.samples = 1;
  options.lights = 40;
  return options;
}

std::map<std::string, std::string> FilesOf(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files[std::filesystem::relative(entry.path(), folder).string()] = ReadFile(entry.path());
    }
  }
  return files;
}

TEST(SimulateTest, WritesACaptureThatReadsBack) {
  const ScratchFolder scratch;
  const SimulateOptions options = TinyOptions(scratch / "capture");
  const SimulateResult result = Simulate(options);
  EXPECT_EQ(result.images_written, 9);
  EXPECT_EQ(result.images_kept, 0);

  const auto capture = OpenCapture(options.out);
  ASSERT_EQ(capture->cameras().size(), 3);
  ASSERT_EQ(capture->frames().size(), 3);
  EXPECT_EQ(capture->TrainingCameras().size(), 2);
  EXPECT_EQ(capture->HeldOutCameras().size(), 1);
  EXPECT_FALSE(capture->HeldOutFrames().empty());
  EXPECT_FALSE(capture->TrainingFrames().empty());
  capture->topology().Check("capture");
  for (const FrameId& frame : capture->frames()) {
    const TrackedFrame tracked = capture->ReadTracked(frame);
    EXPECT_EQ(tracked.vertices_in_head.rows(), capture->topology().vertex_count);
    for (const Camera& camera : capture->cameras()) {
      EXPECT_EQ(camera.width, 64);
      EXPECT_EQ(camera.height, 96);
      const ImageU8 image = capture->ReadCameraImage(frame, camera);
      const auto mask = capture->ReadHeadMask(frame, camera);
      ASSERT_TRUE(mask.has_value());
      // The tracked mesh projects onto head pixels or their neighbours.
      const auto is_near_head = [&](const Eigen::Vector2d& pixel) {
        const int px = static_cast<int>(pixel.x()), py = static_cast<int>(pixel.y());
        for (int y = std::max(py - 1, 0); y <= std::min(py + 1, 95); ++y) {
          for (int x = std::max(px - 1, 0); x <= std::min(px + 1, 63); ++x) {
            if (*mask->at(x, y) > 0) return true;
          }
        }
        return false;
      };
      for (int v = 0; v < tracked.vertices_in_head.rows(); ++v) {
        const Eigen::Vector2d pixel = camera.Project(
            tracked.world_from_head * Eigen::Vector3d(tracked.vertices_in_head.row(v).transpose().cast<double>()));
        EXPECT_TRUE(is_near_head(pixel)) << frame.segment << " " << camera.name << " " << pixel.transpose();
      }
      // Colour only where the head is.
      double head = 0, background = 0;
      for (int y = 0; y < 96; ++y) {
        for (int x = 0; x < 64; ++x) (*mask->at(x, y) > 0 ? head : background) += image.at(x, y)[0];
      }
      EXPECT_EQ(background, 0);
      EXPECT_GT(head, 0);
    }
  }
  for (const char* name : {"performance.csv", "neutral.obj", "lights.csv", "options.json"}) {
    EXPECT_TRUE(std::filesystem::exists(options.out / "truth" / name)) << name;
  }
}

TEST(SimulateTest, AnInterruptedRunResumesAndADoneOneDoesNothing) {
  const ScratchFolder scratch;
  const SimulateOptions options = TinyOptions(scratch / "capture");
  Simulate(options);
  const auto files = FilesOf(options.out);

  EXPECT_EQ(Simulate(options).images_written, 0);
  EXPECT_EQ(FilesOf(options.out), files);

  // One image, one mask and one mesh are lost.
  const auto capture = OpenCapture(options.out);
  const CaptureLayout layout(options.out);
  std::filesystem::remove(layout.Image(capture->frames()[0], "cam01"));
  std::filesystem::remove(layout.HeadMask(capture->frames()[1], "cam02"));
  std::filesystem::remove(layout.MeshBinary(capture->frames()[2]));
  const SimulateResult resumed = Simulate(options);
  EXPECT_EQ(resumed.images_written, 2);
  EXPECT_EQ(resumed.images_kept, 7);
  EXPECT_EQ(FilesOf(options.out), files);
}

TEST(SimulateTest, OtherOptionsNeedAnotherFolder) {
  const ScratchFolder scratch;
  SimulateOptions options = TinyOptions(scratch / "capture");
  Simulate(options);
  options.lights = 41;
  EXPECT_THAT(ErrorOf([&] { Simulate(options); }), HasSubstr("lights was 40, now 41"));
  WriteFile(scratch.path() / "capture" / "truth" / "options.json", "{");
  EXPECT_THAT(ErrorOf([&] { Simulate(options); }), HasSubstr("options.json"));
}

TEST(SimulateTest, FilesDoNotDependOnThreads) {
  const ScratchFolder scratch;
  SetThreadCount(1);
  Simulate(TinyOptions(scratch / "one"));
  SetThreadCount(3);
  Simulate(TinyOptions(scratch / "three"));
  SetThreadCount(0);
  EXPECT_EQ(FilesOf(scratch / "one"), FilesOf(scratch / "three"));
}

TEST(SimulateTest, WrongOptionsAreErrors) {
  const ScratchFolder scratch;
  const auto error = [&](auto change) {
    SimulateOptions options = TinyOptions(scratch / "wrong");
    change(&options);
    return ErrorOf([&] { Simulate(options); });
  };
  EXPECT_NE(error([](SimulateOptions* o) { o->out.clear(); }), "");
  EXPECT_NE(error([](SimulateOptions* o) { o->frames = 1; }), "");
  EXPECT_NE(error([](SimulateOptions* o) { o->lights = 0; }), "");
  EXPECT_NE(error([](SimulateOptions* o) { o->exposure = 0; }), "");
  EXPECT_NE(error([](SimulateOptions* o) { o->performance = "/nonexistent.csv"; }), "");
  EXPECT_THAT(error([](SimulateOptions* o) { o->head = "alien"; }), HasSubstr("there is no head 'alien'"));
  EXPECT_THAT(error([](SimulateOptions* o) { o->head = "procedural:x"; }), HasSubstr("'x' is no seed"));
  EXPECT_THAT(error([](SimulateOptions* o) { o->head = "human:"; }), HasSubstr("human:SEED"));
  EXPECT_THAT(error([&](SimulateOptions* o) {
                o->head = "human:1";
                o->head_data = scratch / "no-data";
              }),
              HasSubstr("--head procedural"));
}

TEST(OpenHeadTest, ThePlainHeadIsItsTrackedMesh) {
  const OpenedHead opened = OpenHead("plain", "");
  ASSERT_EQ(opened.head->surfaces().size(), 1);
  const Surface& skin = opened.head->surfaces()[0];
  const PosedHead posed = opened.head->Pose(std::array<float, kExpressionCount>{});
  EXPECT_EQ(posed.surfaces[0], posed.tracked);
  EXPECT_EQ(skin.topology.triangles, opened.head->tracked_topology().triangles);
  EXPECT_EQ(skin.topology.triangle_uvs, opened.head->tracked_topology().triangle_uvs);
  EXPECT_EQ(skin.topology.uvs, opened.head->tracked_topology().uvs);
}

}  // namespace
}  // namespace likeness
