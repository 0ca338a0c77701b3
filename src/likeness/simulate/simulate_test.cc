#include "likeness/simulate/simulate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/parallel.h"
#include "likeness/base/testing.h"
#include "likeness/capture/condition_file.h"
#include "likeness/capture/layout.h"
#include "likeness/image/image_io.h"
#include "likeness/simulate/gaze_condition.h"
#include "likeness/simulate/human/recipe.h"
#include "likeness/simulate/open_head.h"
#include "likeness/simulate/people.h"

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

// conditions/gaze.csv says where both eyes look, in every frame.
TEST(SimulateTest, WritesGaze) {
  const ScratchFolder scratch;
  const SimulateOptions options = TinyOptions(scratch / "capture");
  Simulate(options);
  const ConditionFile gaze(options.out, "gaze");
  ASSERT_EQ(gaze.size(), 6);
  const auto capture = OpenCapture(options.out);
  for (const FrameId& frame : capture->frames()) {
    const std::vector<float>& eyes = gaze.Of(frame);
    for (const size_t eye : {0, 3}) {
      EXPECT_NEAR(Eigen::Map<const Eigen::Vector3f>(&eyes[eye]).norm(), 1, 1e-5);
      EXPECT_GT(eyes[eye + 2], 0.7f);  // out of the face
    }
  }
  std::array<float, kExpressionCount> weights = {};
  for (const char* name : {"eyeLookInLeft", "eyeLookOutRight", "eyeLookUpLeft"}) weights[ExpressionIndex(name)] = 1;
  const std::array<float, 6> aside = GazeDirections(weights);
  // Towards the subject's right (-x) by 30 degrees; the left eye up by 25 besides.
  EXPECT_NEAR(aside[3], -0.5, 1e-6);
  EXPECT_NEAR(aside[4], 0, 1e-6);
  EXPECT_NEAR(aside[1], std::sin(25 * M_PI / 180), 1e-6);
  EXPECT_LT(aside[0], -0.4f);
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

TEST(SimulateTest, ShardsAddUpToTheWhole) {
  const ScratchFolder scratch;
  SimulateOptions options = TinyOptions(scratch / "whole");
  options.frames = 5;
  options.imperfections.sensor_noise = 2;
  options.imperfections.tracking_noise_mm = 1;
  Simulate(options);
  options.out = scratch / "parts";
  options.shards = 3;
  int frames = 0;
  for (const int shard : {2, 1, 3}) {
    options.shard = shard;
    frames += Simulate(options).frames;
  }
  EXPECT_EQ(frames, 5);
  EXPECT_EQ(FilesOf(scratch / "parts"), FilesOf(scratch / "whole"));
  options.shard = 4;
  EXPECT_THAT(ErrorOf([&] { Simulate(options); }), HasSubstr("no shard 4 of 3"));
}

TEST(SimulateTest, PresetsAreWhatTheySay) {
  const SimulateOptions paper = SimulatePreset("paper");
  EXPECT_EQ(paper.rig.cameras, 40);
  EXPECT_EQ(paper.rig.held_out_cameras, 8);
  EXPECT_EQ(paper.lights, 200);
  EXPECT_EQ(paper.rig.width, 5120);
  EXPECT_EQ(paper.rig.height, 3840);
  EXPECT_EQ(paper.script, Script::kFull);
  for (const char* name : {"demo", "small", "paper"}) {
    SimulateOptions options = SimulatePreset(name);
    options.out = "capture";
    EXPECT_EQ(ErrorOf([&] { options.Check(); }), "") << name;
  }
  EXPECT_THAT(ErrorOf([] { SimulatePreset("large"); }), HasSubstr("demo, small or paper"));
  const Rig rig =
      MakeRig(paper.rig, OpenHead("procedural", "").head->Pose(std::array<float, kExpressionCount>{}).tracked);
  ASSERT_EQ(rig.cameras.size(), 40);
  EXPECT_EQ(rig.held_out.size(), 8);
  for (const Camera& camera : rig.cameras) {
    // 50 mm on a sensor whose diagonal is 43.27 mm and 6400 pixels.
    EXPECT_NEAR(camera.intrinsics(0, 0), 7396, 1);
    EXPECT_GT(camera.CentreInWorld().z(), -60) << camera.name;
  }
}

// Flaws of one kind, and what they must leave as it is.
TEST(SimulateTest, ImperfectionsChangeTheirFilesOnlyAndKeepTheTruth) {
  const ScratchFolder scratch;
  SimulateOptions options = TinyOptions(scratch / "perfect");
  options.frames = 2;
  Simulate(options);
  const auto perfect = FilesOf(options.out);
  const auto changed = [&](const char* name, auto change) {
    SimulateOptions flawed = options;
    flawed.out = scratch / name;
    change(&flawed.imperfections);
    Simulate(flawed);
    std::set<std::string> folders;
    for (const auto& [path, bytes] : FilesOf(flawed.out)) {
      const auto found = perfect.find(path);
      if (path != "truth/options.json" && (found == perfect.end() || found->second != bytes)) {
        folders.insert(path.starts_with("truth/") ? path.substr(0, path.find('/', 6)) : path.substr(0, path.find('/')));
      }
    }
    return folders;
  };
  using Folders = std::set<std::string>;
  EXPECT_EQ(changed("tracking", [](auto* i) { i->tracking_noise_mm = 1; }),
            (Folders{"tracked_mesh", "truth/tracked_mesh"}));
  EXPECT_EQ(changed("smoothing", [](auto* i) { i->tracking_smoothing = 5; }),
            (Folders{"tracked_mesh", "truth/tracked_mesh"}));
  EXPECT_EQ(changed("calibration", [](auto* i) { i->calibration_error_px = 1; }), (Folders{"KRT", "truth/KRT"}));
  const Folders images = {"images", "truth/imperfections.json"};
  EXPECT_EQ(changed("noise", [](auto* i) { i->sensor_noise = 3; }), images);
  EXPECT_EQ(changed("gain", [](auto* i) { i->colour_gain = 0.1; }), images);
  EXPECT_EQ(changed("bias", [](auto* i) { i->colour_bias = 5; }), images);
  EXPECT_EQ(changed("flicker", [](auto* i) { i->exposure_flicker = 0.2; }), images);
  EXPECT_EQ(changed("blur", [](auto* i) { i->lens_blur_px = 1; }), images);
  const auto tracking = FilesOf(scratch / "tracking");
  for (const auto& [path, bytes] : tracking) {
    if (!path.starts_with("truth/tracked_mesh/")) continue;
    EXPECT_EQ(bytes, perfect.at(path.substr(6))) << path;
  }
  EXPECT_EQ(ReadFile(scratch / "calibration" / "truth" / "KRT"), perfect.at("KRT"));
}

TEST(SimulatePeopleTest, DoTheSameBeforeTheSameRig) {
  const ScratchFolder scratch;
  SimulateOptions options = TinyOptions(scratch / "people");
  options.frames = 2;
  options.rig.cameras = 2;
  const std::vector<Person> people = SimulatePeople(options, 3);
  ASSERT_EQ(people.size(), 3);
  const auto first = FilesOf(scratch / "people/person_1"), third = FilesOf(scratch / "people/person_3");
  for (const auto& [path, bytes] : first) {
    ASSERT_TRUE(third.contains(path)) << path;
    // Procedural heads of different seeds have one shape and different skins.
    EXPECT_EQ(bytes == third.at(path), !path.starts_with("images/") && path != "truth/options.json") << path;
  }
  const auto a = OpenCapture(scratch / "people/person_1"), b = OpenCapture(scratch / "people/person_3");
  EXPECT_EQ(a->topology().triangles, b->topology().triangles);
  EXPECT_EQ(a->topology().triangle_uvs, b->topology().triangle_uvs);
  EXPECT_NE(ErrorOf([&] { SimulatePeople(options, 1); }), "");
  EXPECT_NE(ErrorOf([&] { SimulatePeople(options, 65); }), "");
  options.head = "plain";
  EXPECT_THAT(ErrorOf([&] { SimulatePeople(options, 2); }), HasSubstr("human:SEED"));
}

TEST(ChoosePeopleTest, EightAreDiverse) {
  const std::vector<uint64_t> eight = ChoosePeople(8, 7), sixty = ChoosePeople(64, 7);
  EXPECT_TRUE(std::equal(eight.begin(), eight.end(), sixty.begin()));
  EXPECT_EQ(std::set<uint64_t>(sixty.begin(), sixty.end()).size(), 64);
  int male = 0, african = 0, asian = 0, caucasian = 0, old = 0;
  for (const uint64_t seed : eight) {
    const HumanRecipe recipe = RecipeFromSeed(seed);
    male += recipe.male > 0.5 ? 1 : 0;
    african += recipe.african > 0.5 ? 1 : 0;
    asian += recipe.asian > 0.5 ? 1 : 0;
    caucasian += recipe.caucasian > 0.5 ? 1 : 0;
    old += recipe.age > 0.3 ? 1 : 0;
  }
  EXPECT_TRUE(male >= 3 && male <= 5) << male;
  EXPECT_TRUE(african >= 2 && asian >= 2 && caucasian >= 2) << african << " " << asian << " " << caucasian;
  EXPECT_TRUE(old >= 2 && old <= 6) << old;
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
