// Good captures give no finding; captures broken in every known way give the finding that names the way.

#include "likeness/validate/validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/image/image_io.h"
#include "likeness/simulate/simulate.h"
#include "likeness/texture/unwrap_capture.h"
#include "likeness/validate/breakages.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

// Files of the copy are links: the same bytes on disk until they are replaced.
void CopyLinked(const fs::path& from, const fs::path& to) {
  fs::create_directories(to);
  fs::copy(from, to, fs::copy_options::recursive | fs::copy_options::create_hard_links);
}

// Captures made once for all tests.
class ValidateTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    SetQuiet(true);
    scratch_ = new ScratchFolder;
  }
  static void TearDownTestSuite() {
    delete scratch_;
    scratch_ = nullptr;
  }

  static fs::path GoodCapture(const std::string& head, bool textures = false) {
    std::string name = head + (textures ? "_textures" : "");
    std::replace(name.begin(), name.end(), ':', '_');
    const fs::path path = *scratch_ / name;
    if (fs::exists(path)) return path;
    if (textures) {
      CopyLinked(GoodCapture(head), path);
      UnwrapOptions options;
      options.size = 128;
      UnwrapCapture(*OpenCapture(path), options);
      return path;
    }
    SimulateOptions options;
    options.out = path;
    options.head = head;
    if (const auto data = HeadData()) options.head_data = *data;
    options.frames = 10;
    options.rig.cameras = 5;
    options.rig.held_out_cameras = 1;
    options.rig.width = 160;
    options.rig.height = 208;
    options.lights = 24;
    options.render.samples = 2;
    Simulate(options);
    return path;
  }

  static void BreakAndFind(const std::string& head, bool textures, bool pictures_only) {
    const fs::path good_path = GoodCapture(head, textures);
    const auto good = OpenCapture(good_path);
    int found = 0, tried = 0;
    for (const Breakage& breakage : AllBreakages(textures)) {
      if (pictures_only && !breakage.pictures) continue;
      SCOPED_TRACE(head + ": " + breakage.name);
      const ScratchFolder folder;
      const fs::path path = folder / "capture";
      CopyLinked(good_path, path);
      Patient patient = {*good, CaptureWriter(path)};
      breakage.apply(&patient);
      const ValidationReport report = ValidateCapture(path);
      ++tried;
      const Finding* finding = report.Find(breakage.code);
      std::string others;
      for (const Finding& other : report.findings) {
        if (other.code == breakage.code || other.severity == Severity::kNote || breakage.also.contains(other.code))
          continue;
        others += other.code + " ";
      }
      const bool right =
          finding != nullptr && others.empty() && finding->where.find(breakage.where) != std::string::npos;
      fmt::print("  {:<10} {:<45} {:<28} {}\n", head, breakage.name, finding != nullptr ? finding->code : "-",
                 right ? fmt::format("{:.0f}%", 100 * finding->confidence) : "WRONG");
      found += right;
      ASSERT_NE(good->frames().size(), 0u);
      EXPECT_TRUE(right) << ToText(report);
    }
    fmt::print("  {}: {} of {} found and named\n", head, found, tried);
  }

  static void ExpectNothing(const fs::path& path) {
    const ValidationReport report = ValidateCapture(path);
    for (const Finding& finding : report.findings) EXPECT_EQ(finding.severity, Severity::kNote) << ToText(report);
    EXPECT_FALSE(report.MustFix());
    EXPECT_GT(report.overlap, 0.7);
    EXPECT_GT(report.agreement, 0.3);
  }

  static ScratchFolder* scratch_;
};

ScratchFolder* ValidateTest::scratch_ = nullptr;

TEST_F(ValidateTest, GoodProceduralCapturesGiveNoFinding) {
  for (const std::string head : {"procedural", "plain"}) {
    SCOPED_TRACE(head);
    ExpectNothing(GoodCapture(head));
  }
  ExpectNothing(GoodCapture("procedural", true));
}

TEST_F(ValidateTest, GoodHumanCapturesGiveNoFinding) {
  if (!HeadData()) GTEST_SKIP() << "head data absent";
  ExpectNothing(GoodCapture("human:7"));
}

// As published: no masks, no split, and a list that names cameras without images.
TEST_F(ValidateTest, PublishedStyleGivesNoFinding) {
  const ScratchFolder folder;
  const fs::path path = folder / "capture";
  CopyLinked(GoodCapture("procedural"), path);
  fs::remove_all(path / "masks");
  fs::remove(path / "split.json");
  for (const std::string& segment : ListFolder(path / "images")) fs::remove_all(path / "images" / segment / "cam03");
  ExpectNothing(path);
}

// A tracker is a millimetre off, sensors are noisy.
TEST_F(ValidateTest, ImperfectionsGiveNoFinding) {
  const fs::path good_path = GoodCapture("procedural");
  const ScratchFolder folder;
  const fs::path path = folder / "capture";
  CopyLinked(good_path, path);
  const auto good = OpenCapture(good_path);
  const CaptureWriter files(path);
  Random random(7);
  for (const FrameId& frame : good->frames()) {
    TrackedFrame tracked = good->ReadTracked(frame);
    for (Eigen::Index i = 0; i < tracked.vertices_in_head.size(); ++i) {
      tracked.vertices_in_head.data()[i] += static_cast<float>(0.6 * random.Normal());
    }
    for (int i = 0; i < 3; ++i) tracked.world_from_head.translation[i] += 0.5 * random.Normal();
    files.WriteTracked(frame, tracked);
    for (const Camera& camera : good->cameras()) {
      ImageU8 image = good->ReadCameraImage(frame, camera);
      for (uint8_t& value : image.values()) {
        value = static_cast<uint8_t>(std::clamp(value + 3 * random.Normal() + 2, 0.0, 255.0));
      }
      files.WriteImage(frame, camera.name, image);
    }
  }
  ExpectNothing(path);
}

TEST_F(ValidateTest, FindsWhatBreaksProceduralCaptures) { BreakAndFind("procedural", false, false); }

TEST_F(ValidateTest, FindsWhatBreaksTextures) { BreakAndFind("procedural", true, false); }

TEST_F(ValidateTest, FindsWhatBreaksHumanCaptures) {
  if (!HeadData()) GTEST_SKIP() << "head data absent";
  BreakAndFind("human:7", false, true);
}

TEST_F(ValidateTest, DrawsTheEvidence) {
  const fs::path good_path = GoodCapture("procedural");
  const auto good = OpenCapture(good_path);
  const ScratchFolder folder;
  const fs::path path = folder / "capture";
  CopyLinked(good_path, path);
  std::vector<Camera> cameras = good->cameras();
  for (Camera& camera : cameras) camera.cam_from_world.rotation.transposeInPlace();
  CaptureWriter(path).WriteCalibration(cameras);
  ValidateOptions options;
  options.overlay = folder / "evidence";
  const ValidationReport report = ValidateCapture(path, options);
  const Finding* finding = report.Find("rotation-transposed");
  ASSERT_NE(finding, nullptr) << ToText(report);
  EXPECT_EQ(finding->picture, (options.overlay / "rotation-transposed.png").string());
  EXPECT_GT(ReadImage(finding->picture).width(), 300);
  EXPECT_GT(ReadImage(options.overlay / "overview.png").width(), 300);
  EXPECT_THAT(ToJson(report), ::testing::HasSubstr("\"must_fix\": true"));
}

TEST(ValidateFolderTest, OtherFoldersAreRefused) {
  const ScratchFolder folder;
  EXPECT_THAT(ErrorOf([&] { ValidateCapture(folder / "absent"); }), ::testing::HasSubstr("no such folder"));
  EXPECT_THAT(ErrorOf([&] { ValidateCapture(folder.path()); }), ::testing::HasSubstr("is no capture"));
}

}  // namespace
}  // namespace likeness
