#include "likeness/capture/inspect.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/capture/contact_sheet.h"
#include "likeness/capture/layout.h"
#include "likeness/capture/writer.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Two cameras in front of and beside a tetrahedron with a vertex to spare; three frames in two segments.
class InspectTest : public ::testing::Test {
 protected:
  InspectTest() : writer_(scratch_ / "capture"), layout_(scratch_ / "capture") {
    cameras_.push_back(LookAt({0, 0, 1000}, {0, 0, 0}, {0, 1, 0}, 300, 60, 80));
    cameras_.back().name = "front";
    cameras_.push_back(LookAt({800, 0, 600}, {0, 0, 0}, {0, 1, 0}, 300, 60, 80));
    cameras_.back().name = "side";
    topology_.vertex_count = 5;
    topology_.uvs = {{0, 0}, {1, 0}, {0, 1}};
    topology_.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
    topology_.triangle_uvs = {{0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {0, 1, 2}};
    tracked_.vertices_in_head.resize(5, 3);
    tracked_.vertices_in_head << 0, 0, 60, -80, -50, 0, 80, -50, 0, 0, 100, 0, 9000, 9000, 9000;
    writer_.WriteCalibration(cameras_);
    writer_.WriteFrameList(frames_);
    writer_.WriteSplit({{"front"}, {"side"}, {"speech"}});
    for (const FrameId& frame : frames_) {
      writer_.WriteTracked(frame, tracked_);
      writer_.WriteObj(frame, tracked_.vertices_in_head, topology_);
      for (const Camera& camera : cameras_) {
        writer_.WriteImage(frame, camera.name, ImageU8(60, 80, 3, 40));
        writer_.WriteHeadMask(frame, camera.name, ImageU8(60, 80, 1, 255));
      }
      WritePng(layout_.AverageTexture(frame, 64), ImageU8(64, 64, 3));
    }
    for (const auto& path :
         {layout_.TextureMean(), layout_.TextureVariance(), layout_.VertexMean(), layout_.VertexVariance()}) {
      WriteFile(path, "1");
    }
  }

  std::unique_ptr<Capture> Open() const { return OpenCapture(scratch_ / "capture"); }

  ScratchFolder scratch_;
  CaptureWriter writer_;
  CaptureLayout layout_;
  std::vector<Camera> cameras_;
  std::vector<FrameId> frames_ = {{"smile", "000001"}, {"smile", "000002"}, {"speech_1", "000009"}};
  MeshTopology topology_;
  TrackedFrame tracked_;
};

TEST_F(InspectTest, CountsACompleteCapture) {
  const CaptureSummary summary = Summarize(*Open());
  EXPECT_THAT(summary.missing, IsEmpty());
  EXPECT_EQ(summary.frames, 3);
  ASSERT_EQ(summary.cameras.size(), 2u);
  EXPECT_EQ(summary.cameras[1].name, "side");
  EXPECT_EQ(summary.cameras[1].width, 60);
  EXPECT_EQ(summary.cameras[1].height, 80);
  EXPECT_EQ(summary.cameras[1].focal_px, 300);
  EXPECT_NEAR(summary.cameras[1].distance_mm, 1000, 1e-6);
  EXPECT_EQ(summary.cameras[1].role, CameraRole::kHeldOut);
  EXPECT_EQ(summary.cameras[0].images, 3);
  EXPECT_EQ(summary.cameras[0].masks, 3);
  ASSERT_EQ(summary.segments.size(), 2u);
  EXPECT_EQ(summary.segments[0].frames, 2);
  EXPECT_FALSE(summary.segments[0].held_out);
  EXPECT_TRUE(summary.segments[1].held_out);
  EXPECT_EQ(summary.vertices, 5);
  EXPECT_EQ(summary.vertices_in_triangles, 4);
  EXPECT_EQ(summary.mesh_width_mm, 160);
  EXPECT_EQ(summary.mesh_height_mm, 150);
  ASSERT_EQ(summary.textures.size(), 1u);
  EXPECT_EQ(summary.textures[0].size, 64);
  EXPECT_EQ(summary.textures[0].averages, 3);
  EXPECT_TRUE(summary.has_statistics);
}

TEST_F(InspectTest, SaysWhatIsMissing) {
  writer_.WriteFrameList({frames_[0], frames_[1], {"smile", "000777"}, frames_[2]});
  std::filesystem::remove(layout_.SplitFile());
  std::filesystem::remove_all(layout_.Image(frames_[0], "side").parent_path());
  std::filesystem::remove_all(layout_.HeadMask(frames_[0], "front").parent_path().parent_path().parent_path());
  std::filesystem::remove(layout_.AverageTexture(frames_[2], 64));
  std::filesystem::remove(layout_.TextureVariance());
  const CaptureSummary summary = Summarize(*Open());
  EXPECT_EQ(summary.skipped_frames, 1);
  EXPECT_EQ(summary.cameras[1].images, 1);
  EXPECT_FALSE(summary.has_statistics);
  EXPECT_THAT(summary.missing, Contains(HasSubstr("000777")));
  EXPECT_THAT(summary.missing, Contains(HasSubstr("side (1 of 3)")));
  EXPECT_THAT(summary.missing, Contains(HasSubstr("no head masks of 2 camera(s)")));
  EXPECT_THAT(summary.missing, Contains(HasSubstr("no camera is held out")));
  EXPECT_THAT(summary.missing, Contains(HasSubstr("no segment is held out")));
  EXPECT_THAT(summary.missing, Contains(HasSubstr("for 2 of 3 frames")));
  EXPECT_THAT(summary.missing, Contains(HasSubstr("no statistics")));
  for (const std::string& sentence : summary.missing) EXPECT_THAT(ToText(summary), HasSubstr(sentence));
}

TEST_F(InspectTest, JsonSaysTheSame) {
  const auto json = nlohmann::json::parse(ToJson(Summarize(*Open())));
  EXPECT_EQ(json["cameras"][1]["role"], "held out");
  EXPECT_EQ(json["segments"][1]["held_out"], true);
  EXPECT_EQ(json["mesh"]["triangles"], 4);
  EXPECT_EQ(json["missing"].size(), 0u);
}

TEST_F(InspectTest, SheetShowsEveryCellAndSurvivesHolesInTheCapture) {
  const ImageU8 complete = DrawContactSheet(*Open());
  std::filesystem::remove(layout_.Image(frames_[1], "side"));
  WriteFile(layout_.Image(frames_[2], "side"), "no picture");
  const ImageU8 holes = DrawContactSheet(*Open());
  EXPECT_TRUE(complete.SameShape(holes));
  EXPECT_NE(complete, holes);
  ContactSheetOptions options;
  options.cameras = 0;
  EXPECT_THAT(ErrorOf([&] { DrawContactSheet(*Open(), options); }), HasSubstr("cameras"));
}

TEST_F(InspectTest, WireframeLiesOnTheProjectedVisibleEdges) {
  ImageU8 picture(600, 800, 3);
  const Camera camera = cameras_[0].Resized(600, 800);
  DrawWireframe(&picture, camera, tracked_, topology_);
  const auto at = [&](const Eigen::Vector3d& point) {
    const Eigen::Vector2d pixel = camera.Project(point);
    return picture.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()))[2];
  };
  EXPECT_GT(at({-40, -25, 30}), 40);  // the middle of an edge from the nose
  EXPECT_GT(at({0, -50, 0}), 40);     // an edge of the silhouette
  EXPECT_EQ(at({-20, 0, 10}), 0);     // inside a triangle
  // Seen from behind, the three faces at the nose are hidden.
  picture = ImageU8(600, 800, 3);
  const Camera behind = LookAt({0, 0, -1000}, {0, 0, 0}, {0, 1, 0}, 3000, 600, 800);
  DrawWireframe(&picture, behind, tracked_, topology_);
  const Eigen::Vector2d hidden = behind.Project({-40, -25, 30}), seen = behind.Project({0, -50, 0});
  EXPECT_EQ(picture.at(static_cast<int>(hidden.x()), static_cast<int>(hidden.y()))[2], 0);
  EXPECT_GT(picture.at(static_cast<int>(seen.x()), static_cast<int>(seen.y()))[2], 40);
}

TEST(EvenlySpreadTest, KeepsTheEnds) {
  EXPECT_THAT(EvenlySpread(10, 4), ElementsAre(0, 3, 6, 9));
  EXPECT_THAT(EvenlySpread(3, 5), ElementsAre(0, 1, 2));
  EXPECT_THAT(EvenlySpread(7, 1), ElementsAre(0));
  EXPECT_THAT(EvenlySpread(0, 3), IsEmpty());
}

}  // namespace
}  // namespace likeness
