#include "likeness/capture/proxy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/capture/convert.h"
#include "likeness/capture/inspect.h"
#include "likeness/capture/proxy_record.h"
#include "likeness/capture/writer.h"
#include "likeness/geometry/proxy_mesh.h"
#include "likeness/geometry/ray_scene.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// A lumpy ball of the size of a head, other lumps in each of three frames, seen by four cameras; one is held out.
class ProxyTest : public ::testing::Test {
 protected:
  ProxyTest() : layout_(scratch_ / "source"), writer_(scratch_ / "source") {
    SetQuiet(true);
    for (const double angle : {-1.4, -0.5, 0.1, 0.8}) {
      cameras_.push_back(
          LookAt({1000 * std::sin(angle), 40, 1000 * std::cos(angle)}, {0, 0, 0}, {0, 1, 0}, 200, 40, 60));
      cameras_.back().name = "cam" + std::to_string(cameras_.size());
    }
    Ellipsoid ball;
    ball.from_ball = Eigen::Vector3d(70, 100, 85).asDiagonal();
    const ProxyMesh mesh = EllipsoidMesh(ball);
    MeshTopology topology = mesh.topology;
    ++topology.vertex_count;  // one without a triangle, far off
    writer_.WriteCalibration(cameras_);
    writer_.WriteFrameList(frames_);
    writer_.WriteSplit({{"cam1", "cam2", "cam3"}, {"cam4"}, {"held"}});
    for (size_t f = 0; f < frames_.size(); ++f) {
      Random random(f);
      TrackedFrame tracked;
      tracked.vertices_in_head.resize(topology.vertex_count, 3);
      tracked.vertices_in_head.topRows(mesh.vertices.rows()) = mesh.vertices;
      for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
        tracked.vertices_in_head.row(i) *= static_cast<float>(1 + 0.02 * random.Normal());
      }
      tracked.vertices_in_head.bottomRows(1).setConstant(1e5f);
      tracked.world_from_head = {RotationFromYawPitchRoll(0.05 * static_cast<double>(f), 0.02, 0.03), {1, 2, 3}};
      writer_.WriteTracked(frames_[f], tracked);
      writer_.WriteObj(frames_[f], tracked.vertices_in_head, topology);
      for (const Camera& camera : cameras_) {
        writer_.WriteImage(frames_[f], camera.name, ImageU8(40, 60, 3, static_cast<uint8_t>(50 + f)));
        writer_.WriteHeadMask(frames_[f], camera.name, ImageU8(40, 60, 1, 255));
      }
    }
    source_ = OpenCapture(scratch_ / "source");
    options_.out = scratch_ / "out";
  }

  std::unique_ptr<Capture> Make(const std::string& kind, int iterations = 20) {
    options_.kind = kind;
    options_.iterations = iterations;
    report_ = MakeProxy(*source_, options_);
    return OpenCapture(options_.out);
  }

  // Everything but the meshes is as it was.
  void ExpectShared(const Capture& proxy) {
    EXPECT_EQ(proxy.frames(), source_->frames());
    EXPECT_EQ(proxy.split().held_out_cameras, source_->split().held_out_cameras);
    EXPECT_EQ(proxy.split().held_out_segments, source_->split().held_out_segments);
    for (const FrameId& frame : frames_) {
      EXPECT_EQ(proxy.ReadTracked(frame).world_from_head.rotation,
                source_->ReadTracked(frame).world_from_head.rotation);
      for (const Camera& camera : proxy.cameras()) {
        EXPECT_EQ(proxy.ReadCameraImage(frame, camera).values()[0],
                  source_->ReadCameraImage(frame, camera).values()[0]);
        EXPECT_TRUE(fs::is_symlink(CaptureLayout(options_.out).Image(frame, camera.name)));
        EXPECT_TRUE(proxy.ReadHeadMask(frame, camera).has_value());
      }
    }
    EXPECT_EQ(report_.files_linked, 2 * 3 * 4);
  }

  ScratchFolder scratch_;
  const CaptureLayout layout_;
  const CaptureWriter writer_;
  const std::vector<FrameId> frames_ = {{"talk", "000001"}, {"talk", "000002"}, {"held", "000007"}};
  std::vector<Camera> cameras_;
  std::unique_ptr<Capture> source_;
  ProxyOptions options_;
  ProxyReport report_;
};

TEST_F(ProxyTest, TaubinSmoothsEveryFrame) {
  const auto proxy = Make("taubin");
  ExpectShared(*proxy);
  EXPECT_EQ(GeometryOf(options_.out), Geometry::kSmoothed);
  EXPECT_EQ(proxy->topology().triangles, source_->topology().triangles);
  EXPECT_NE(proxy->ReadTracked(frames_[0]).vertices_in_head, proxy->ReadTracked(frames_[1]).vertices_in_head);
  const auto bumps = [&](const Capture& capture) {
    const Vertices vertices = capture.ReadTracked(frames_[0]).vertices_in_head;
    double sum = 0;
    for (const Eigen::Vector3i& t : capture.topology().triangles) {
      sum += std::abs(vertices.row(t[0]).norm() - vertices.row(t[1]).norm());
    }
    return sum;
  };
  EXPECT_LT(bumps(*proxy), 0.5 * bumps(*source_));
}

TEST_F(ProxyTest, TheEllipsoidStandsStillAroundAllFrames) {
  const auto proxy = Make("ellipsoid");
  ExpectShared(*proxy);
  EXPECT_EQ(GeometryOf(options_.out), Geometry::kEllipsoid);
  const Vertices vertices = proxy->ReadTracked(frames_[0]).vertices_in_head;
  EXPECT_EQ(vertices, proxy->ReadTracked(frames_[2]).vertices_in_head);
  EXPECT_LT(vertices.rowwise().norm().maxCoeff(), 130);
  // Every vertex with a triangle lies behind all faces.
  float least = 1e9f;
  for (const FrameId& frame : frames_) {
    const Vertices inner = source_->ReadTracked(frame).vertices_in_head;
    for (const Eigen::Vector3i& t : proxy->topology().triangles) {
      const Eigen::Vector3f a = vertices.row(t[0]), b = vertices.row(t[1]), c = vertices.row(t[2]);
      const Eigen::Vector3f normal = (b - a).cross(c - a).normalized();
      const float most = (inner.topRows(inner.rows() - 1) * normal).maxCoeff();
      least = std::min(least, normal.dot(a) - most);
    }
  }
  EXPECT_GE(least, -1e-3f);
  EXPECT_LT(least, 2);  // and it is no larger than it must be
}

TEST_F(ProxyTest, TheBoardFacesTheFrontAndIsSeenByEveryCameraBeforeIt) {
  const auto proxy = Make("billboard");
  ExpectShared(*proxy);
  EXPECT_EQ(GeometryOf(options_.out), Geometry::kBillboard);
  const Vertices board = proxy->ReadTracked(frames_[0]).vertices_in_head;
  EXPECT_EQ(board.rows(), 4);
  EXPECT_GT(board(0, 2), 30);
  EXPECT_LT(board(0, 2), 85);
  RayScene scene;
  scene.Add(board, proxy->topology().triangles, true);
  scene.Build();
  for (const FrameId& frame : frames_) {
    const TrackedFrame tracked = source_->ReadTracked(frame);
    for (size_t c = 1; c < cameras_.size(); ++c) {  // the first one stands at 80 degrees
      const Eigen::Vector3d eye = tracked.world_from_head.Inverse() * cameras_[c].CentreInWorld();
      for (Eigen::Index i = 0; i + 1 < tracked.vertices_in_head.rows(); ++i) {
        Ray ray;
        ray.origin = eye.cast<float>();
        ray.direction = tracked.vertices_in_head.row(i).transpose() - ray.origin;
        ray.direction = (ray.origin + 0.9999f * ray.direction - ray.origin).normalized();
        EXPECT_GE(scene.Intersect(ray).triangle, 0) << cameras_[c].name << ' ' << i;
        if (HasFailure()) return;
      }
    }
  }
}

TEST_F(ProxyTest, InspectAndConvertKnowTheGeometry) {
  const auto proxy = Make("billboard");
  EXPECT_THAT(ToText(Summarize(*proxy)), HasSubstr("billboard: 4 vertices"));
  EXPECT_THAT(ToText(Summarize(*source_)), HasSubstr("tracked: "));
  ConvertOptions convert;
  convert.out = scratch_ / "copy";
  convert.link = true;
  EXPECT_EQ(ConvertCapture(*proxy, convert).images_linked, 12);
  EXPECT_EQ(GeometryOf(convert.out), Geometry::kBillboard);
  const auto copy = OpenCapture(convert.out);
  EXPECT_FALSE(fs::is_symlink(CaptureLayout(convert.out).Image(frames_[0], "cam1")));
  EXPECT_EQ(copy->ReadCameraImage(frames_[0], copy->cameras()[0]).values()[0], 50);
}

TEST_F(ProxyTest, WhatIsWrittenOverALinkSparesTheSource) {
  Make("taubin");
  CaptureWriter(options_.out).WriteImage(frames_[0], "cam1", ImageU8(40, 60, 3, 200));
  EXPECT_EQ(source_->ReadCameraImage(frames_[0], source_->cameras()[0]).values()[0], 50);
}

TEST_F(ProxyTest, GoesOnAndSaysWhatIsWrong) {
  Make("ellipsoid");
  fs::remove(CaptureLayout(options_.out).Image(frames_[1], "cam2"));
  Make("ellipsoid");
  EXPECT_EQ(report_.files_linked, 1);
  EXPECT_EQ(report_.files_kept, 23);
  EXPECT_THAT(ErrorOf([&] { Make("billboard"); }), HasSubstr("otherwise (other kind)"));
  EXPECT_THAT(ErrorOf([&] { Make("sphere"); }), HasSubstr("taubin, ellipsoid, billboard"));
  EXPECT_THAT(ErrorOf([&] { Make("taubin", -3); }), HasSubstr("iterations"));
  const auto proxy = OpenCapture(options_.out);
  const ProxyOptions twice = {scratch_ / "twice", "taubin", 1};
  EXPECT_THAT(ErrorOf([&] { MakeProxy(*proxy, twice); }), HasSubstr("ellipsoid already"));
  EXPECT_THAT(ErrorOf([&] { MakeProxy(*source_, {scratch_ / "source/in", "taubin", 1}); }), HasSubstr("lie in each"));
}

TEST(GeometryRecord, BadOnesAreErrors) {
  for (const char* text : {"", "[]", "{}", R"({"geometry": 3})", R"({"geometry": "cube"})"}) {
    EXPECT_THAT(ErrorOf([&] { ParseGeometryRecord("g.json", text); }), HasSubstr("g.json")) << text;
  }
  EXPECT_EQ(ParseGeometryRecord("g.json", R"({"geometry": "billboard"})"), Geometry::kBillboard);
}

}  // namespace
}  // namespace likeness
