// Captures out to other tools' formats and back, through a lens, and with meshes in the world.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/testing.h"
#include "likeness/capture/import/export_capture.h"
#include "likeness/capture/import/file_pattern.h"
#include "likeness/capture/import/import_capture.h"
#include "likeness/capture/writer.h"
#include "likeness/geometry/obj.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

class ImportTest : public ::testing::Test {
 protected:
  ImportTest() : writer_(scratch_ / "capture") {
    SetQuiet(true);
    frames_ = {{"E1", "000001"}, {"E1", "000002"}};
    for (int i = 0; i < 3; ++i) {
      cameras_.push_back(LookAt({300.0 * i - 290.1, 77.7, 1000.0}, {10, 0, 0}, {0, 1, 0}, 90.3, 64, 48));
      cameras_.back().name = "cam" + std::to_string(i);
    }
    topology_.vertex_count = 4;
    topology_.uvs = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
    topology_.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
    topology_.triangle_uvs = topology_.triangles;
    writer_.WriteCalibration(cameras_);
    writer_.WriteFrameList(frames_);
    for (size_t i = 0; i < 2; ++i) {
      writer_.WriteTracked(frames_[i], {HeadVertices(), Pose(i)});
      writer_.WriteObj(frames_[i], HeadVertices(), topology_);
      for (const Camera& camera : cameras_) {
        writer_.WriteImage(frames_[i], camera.name, Picture(static_cast<int>(i)));
        writer_.WriteHeadMask(frames_[i], camera.name, ImageU8(64, 48, 1, 255));
      }
    }
    writer_.WriteValidMask("cam1", ImageU8(64, 48, 1, 0));
    options_.out = scratch_ / "imported";
  }

  static Vertices HeadVertices() {
    Vertices vertices(4, 3);
    vertices << 0, 0, 80, -60, -50, -20, 60, -50, -20, 0, 90, -30;
    return vertices;
  }
  static RigidTransform Pose(size_t i) {
    return {RotationFromYawPitchRoll(0.1 * static_cast<double>(i), 0.05, 0.02), {10, 5, 3.0 * static_cast<double>(i)}};
  }
  static ImageU8 Picture(int seed) {
    ImageU8 image(64, 48, 3);
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        image.at(x, y)[0] = static_cast<uint8_t>(3 * x);
        image.at(x, y)[1] = static_cast<uint8_t>(4 * y);
        image.at(x, y)[2] = static_cast<uint8_t>(50 + seed);
      }
    }
    return image;
  }

  void Export(const std::string& format, bool text, const std::string& unit) {
    ExportOptions options;
    options.out = scratch_ / "exported";
    options.format = format;
    options.text = text;
    options.unit = unit;
    fs::remove_all(options.out);
    fs::remove_all(options_.out);
    const ExportResult result = ExportCapture(*OpenCapture(scratch_ / "capture"), options);
    EXPECT_EQ(result.cameras, 3);
    EXPECT_EQ(result.masks, 3);
    EXPECT_EQ(result.points, 4);
    options_.kind = format;
    options_.source = options.out;
    options_.unit = unit;
  }
  std::string Everything(const std::string& part) const { return (scratch_ / "capture" / part).string(); }
  void UseEverything() {
    options_.images = Everything("images/{segment}/{camera}/{frame}.png");
    options_.masks = Everything("masks/{segment}/{camera}/{frame}.png");
    options_.meshes = Everything("tracked_mesh/{segment}/{frame}.bin");
    options_.poses = Everything("tracked_mesh/{segment}/{frame}_transform.txt");
    options_.topology = Everything("tracked_mesh/E1/000001.obj");
  }
  void ExpectSameCameras(const std::vector<Camera>& read) const {
    ASSERT_EQ(read.size(), cameras_.size());
    for (size_t i = 0; i < read.size(); ++i) {
      EXPECT_EQ(read[i].name, cameras_[i].name);
      EXPECT_EQ(read[i].intrinsics, cameras_[i].intrinsics);
      EXPECT_LT((read[i].cam_from_world.rotation - cameras_[i].cam_from_world.rotation).norm(), 1e-13);
      EXPECT_LT((read[i].cam_from_world.translation - cameras_[i].cam_from_world.translation).norm(), 1e-10);
    }
  }

  ScratchFolder scratch_;
  CaptureWriter writer_;
  std::vector<Camera> cameras_;
  std::vector<FrameId> frames_;
  MeshTopology topology_;
  ImportOptions options_;
};

TEST_F(ImportTest, ExportAndImportGiveTheSameCapture) {
  struct Case {
    const char* format;
    bool text;
    const char* unit;
  };
  for (const Case& c : {Case{"nerfstudio", false, "mm"}, Case{"colmap", false, "m"}, Case{"colmap", true, "inch"}}) {
    Export(c.format, c.text, c.unit);
    UseEverything();
    options_.mesh_unit = "mm";
    const ImportResult result = ImportCapture(options_);
    EXPECT_EQ(result.images_copied, 6);
    EXPECT_EQ(result.images_written, 0);
    EXPECT_EQ(result.valid_masks, 0);
    EXPECT_NEAR(result.distance_to_focus_mm, 1000, 60);
    const std::string image = "images/E1/cam2/000002.png";
    EXPECT_EQ(ReadFile(options_.out / image), ReadFile(scratch_ / "capture" / image));
    const auto capture = OpenCapture(options_.out);
    ExpectSameCameras(capture->cameras());
    EXPECT_EQ(capture->frames(), frames_);
    EXPECT_EQ(capture->ReadTracked(frames_[1]).vertices_in_head, HeadVertices());
    EXPECT_EQ(capture->ReadTracked(frames_[1]).world_from_head.translation, Pose(1).translation);
    EXPECT_EQ(ImportCapture(options_).images_kept, 6);
  }
}

TEST_F(ImportTest, OneInstantNeedsNoPatternAndMasksComeAlong) {
  Export("nerfstudio", false, "mm");
  const ImportResult result = ImportCapture(options_);
  EXPECT_EQ(result.frames, 1);
  EXPECT_EQ(result.images_copied, 3);
  EXPECT_THAT(result.remarks, Contains(HasSubstr("no tracked meshes")));
  const CaptureLayout layout(options_.out);
  EXPECT_EQ(ReadImage(layout.HeadMask({"capture", "000000"}, "cam0"), 1), ImageU8(64, 48, 1, 255));
  EXPECT_EQ(ReadImage(layout.HeadMask({"capture", "000000"}, "cam1"), 1), ImageU8(64, 48, 1, 0));  // not valid
  options_.shrink = 2;
  EXPECT_THAT(ErrorOf([&] { ImportCapture(options_); }), HasSubstr("other options"));
}

TEST_F(ImportTest, ALensIsUndoneAndLeavesAMaskOfValidPixels) {
  std::string text;
  for (const Camera& camera : cameras_) {
    const auto& k = camera.intrinsics;
    const auto& r = camera.cam_from_world.rotation;
    const auto& t = camera.cam_from_world.translation;
    text += fmt::format("K_{0}: [{1}, 0, {2}, 0, {3}, {4}, 0, 0, 1]\nD_{0}: [0.3, 0, 0, 0]\n", camera.name, k(0, 0),
                        k(0, 2) - 0.5, k(1, 1), k(1, 2) - 0.5);
    text +=
        fmt::format("R_{}: [{}, {}, {}, {}, {}, {}, {}, {}, {}]\nT_{}: [{}, {}, {}]\n", camera.name, r(0, 0), r(0, 1),
                    r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2), camera.name, t.x(), t.y(), t.z());
  }
  WriteFile(scratch_ / "rig.yml", text);
  options_.kind = "opencv";
  options_.source = scratch_ / "rig.yml";
  UseEverything();
  const ImportResult result = ImportCapture(options_);
  EXPECT_EQ(result.images_written, 6);
  EXPECT_EQ(result.valid_masks, 3);
  const auto capture = OpenCapture(options_.out);
  ExpectSameCameras(capture->cameras());
  const ImageU8 valid = *capture->ReadValidMask(capture->cameras()[0]);
  EXPECT_EQ(*valid.at(0, 0), 0);
  EXPECT_EQ(*valid.at(32, 24), 255);
  EXPECT_EQ(*capture->ReadHeadMask(frames_[0], capture->cameras()[0]), valid);
  // The pictures' colours are their own coordinates: red / 3 is where a pixel came from.
  const ImageU8 image = capture->ReadCameraImage(frames_[0], capture->cameras()[0]);
  const double x = (50.5 - 32) / 90.3, y = (30.5 - 24) / 90.3;
  EXPECT_NEAR(image.at(50, 30)[0] / 3.0, 90.3 * x * (1 + 0.3 * (x * x + y * y)) + 32 - 0.5, 0.2);
}

TEST_F(ImportTest, HeadPosesAreFoundFromMeshesInTheWorld) {
  Export("nerfstudio", false, "mm");
  for (size_t i = 0; i < 2; ++i) {
    Vertices in_world = HeadVertices();
    for (int v = 0; v < 4; ++v) {
      in_world.row(v) = (Pose(i) * in_world.row(v).transpose().cast<double>()).cast<float>();
    }
    likeness::WriteObj(scratch_ / ("mesh" + frames_[i].frame + ".obj"), in_world, topology_);
  }
  UseEverything();
  options_.meshes = (scratch_ / "mesh{frame}.obj").string();
  options_.poses.clear();
  options_.topology.clear();
  options_.mesh_space = "world";
  options_.up = "0,1,0";
  ImportCapture(options_);
  const auto capture = OpenCapture(options_.out);
  const TrackedFrame first = capture->ReadTracked(frames_[0]), second = capture->ReadTracked(frames_[1]);
  EXPECT_LT((first.vertices_in_head - second.vertices_in_head).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LT(first.vertices_in_head.colwise().mean().norm(), 1e-3);
  EXPECT_GT(first.vertices_in_head(0, 2), 50);  // the nose towards the cameras
  EXPECT_GT(first.vertices_in_head(2, 0), 50);  // the subject's left
  const RigidTransform motion = second.world_from_head * first.world_from_head.Inverse();
  const RigidTransform truth = Pose(1) * Pose(0).Inverse();
  EXPECT_LT((motion.rotation - truth.rotation).norm(), 1e-5);
  EXPECT_LT((motion.translation - truth.translation).norm(), 1e-3);
}

TEST_F(ImportTest, WrongThingsAreNamed) {
  Export("colmap", false, "m");
  const auto error = [&] { return ErrorOf([&] { ImportCapture(options_); }); };
  options_.kind = "colmp";
  EXPECT_THAT(error(), HasSubstr("did you mean 'colmap'?"));
  options_.kind = "colmap";
  options_.images = Everything("images/{segment}/{kamera}/{frame}.png");
  EXPECT_THAT(error(), HasSubstr("'{kamera}' is not known"));
  options_.images = Everything("images/{segment}/c{camera}/{frame}.png");
  EXPECT_THAT(error(), AllOf(HasSubstr("images are of am0, am1, am2"), HasSubstr("the calibration has cam0")));
  options_.images = Everything("pictures/{segment}/{camera}/{frame}.png");
  EXPECT_THAT(error(), HasSubstr("no file matches"));
  options_.images.clear();
  options_.unit = "mm";
  EXPECT_THAT(ImportCapture(options_).remarks, Contains(HasSubstr("which is no distance to a head")));
  options_.out = scratch_ / "capture";
  EXPECT_THAT(error(), HasSubstr("was not imported"));
}

TEST_F(ImportTest, PatternsFindFiles) {
  const auto files = FindFiles(Everything("images/{segment}/cam{camera}/{frame}.png"));
  ASSERT_EQ(files.size(), 6u);
  EXPECT_TRUE(files.contains({"E1", "2", "000001"}));
  EXPECT_EQ(FindFiles(Everything("images/E1/{camera}/000001.png")).size(), 3u);
}

}  // namespace
}  // namespace likeness
