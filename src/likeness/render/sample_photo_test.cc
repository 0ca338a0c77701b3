// A photograph decides which way round meshes and textures are drawn: the published mesh with its texture is fitted to
// the photograph of the same instant, whose camera is not told, and must look more like it than anything mirrored.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/geometry/obj.h"
#include "likeness/image/image_io.h"
#include "likeness/image/resize.h"
#include "likeness/render/portrait.h"
#include "likeness/render/rasterizer.h"

namespace likeness {
namespace {

constexpr int kWidth = 63, kHeight = 96;

ImageU8 Mirrored(const ImageU8& image) {
  ImageU8 mirrored = image;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) std::copy_n(image.at(image.width() - 1 - x, y), 3, mirrored.at(x, y));
  }
  return mirrored;
}

ImageU8 UpsideDown(const ImageU8& image) {
  ImageU8 turned = image;
  const auto bytes = static_cast<size_t>(image.width()) * 3;
  for (int y = 0; y < image.height(); ++y) std::copy_n(image.row(image.height() - 1 - y), bytes, turned.row(y));
  return turned;
}

// Pearson's correlation of all values of two pictures.
double Correlation(const ImageU8& a, const ImageU8& b) {
  const auto values = [](const ImageU8& image) {
    return Eigen::Map<const Eigen::Array<uint8_t, Eigen::Dynamic, 1>>(image.values().data(),
                                                                      static_cast<Eigen::Index>(image.values().size()))
        .cast<double>()
        .eval();
  };
  const Eigen::ArrayXd u = values(a) - values(a).mean(), v = values(b) - values(b).mean();
  return (u * v).sum() / std::sqrt(u.square().sum() * v.square().sum());
}

struct Head {
  Vertices vertices;
  MeshTopology topology;
};

// Azimuth, elevation and roll in degrees, focal length, and the shift of the principal point, px.
using Pose = Eigen::Matrix<double, 6, 1>;

ImageU8 Draw(const Head& head, const ImageF& texture, const Pose& pose) {
  PortraitOptions view;
  view.azimuth_deg = pose[0];
  view.elevation_deg = pose[1];
  view.focal_px = pose[3];
  view.width = kWidth;
  view.height = kHeight;
  Camera camera = PortraitCamera(head.vertices, head.topology, view);
  const Eigen::Matrix3d roll = Eigen::AngleAxisd(pose[2] * M_PI / 180, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  camera.cam_from_world = RigidTransform{roll, Eigen::Vector3d::Zero()} * camera.cam_from_world;
  camera.intrinsics(0, 2) += pose[4];
  camera.intrinsics(1, 2) += pose[5];
  DrawOptions draw;
  draw.supersample = 1;
  return DrawMesh(head.vertices, head.topology, texture, camera, {}, draw).colour;
}

// The best correlation that small steps from `pose` reach.
double Fit(const ImageU8& photo, const Head& head, const ImageU8& texture, Pose pose) {
  const ImageF texels = ToFloat(ResizeArea(texture, 256, 256));
  Pose step;
  step << 4, 4, 3, 12, 3, 3;
  double best = Correlation(photo, Draw(head, texels, pose));
  for (int round = 0; round < 8; ++round) {
    bool moved = false;
    for (int axis = 0; axis < 6; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        Pose trial = pose;
        trial[axis] += sign * step[axis];
        const double score = Correlation(photo, Draw(head, texels, trial));
        if (score <= best) continue;
        best = score;
        pose = trial;
        moved = true;
      }
    }
    if (!moved) step *= 0.5;
  }
  return best;
}

TEST(SamplePhotoTest, NothingMirroredOrFlippedLooksMoreLikeThePhotograph) {
  const auto folder = SampleData("ava256");
  if (!folder) GTEST_SKIP() << "sample data absent";
  const ImageU8 photo = ResizeArea(ReadImage(*folder / "021924.png"), kWidth, kHeight);
  const ImageU8 texture = ReadImage(*folder / "021924_avgtex.png");
  Head head;
  const auto obj = *folder / "face_topology.obj";
  head.topology = TopologyFromObj(ReadObj(obj), obj.string());
  const std::vector<float> values = ReadFloats(*folder / "021924.bin", 21918);
  head.vertices = Eigen::Map<const Vertices>(values.data(), 7306, 3);
  // From below and the subject's left; a focal length of 7,700 px for 1334, as the KRT beside it has.
  const double focal = 7700.0 * kWidth / 1334;
  Pose pose, mirrored_pose;
  pose << 5, -25, 0, focal, 0, 12;
  mirrored_pose << -5, -25, 0, focal, 0, 12;
  const double score = Fit(photo, head, texture, pose);
  const double mirrored_texture = Fit(photo, head, Mirrored(texture), pose);
  const double mirrored_head = Fit(Mirrored(photo), head, texture, mirrored_pose);
  const double flipped_texture = Fit(photo, head, UpsideDown(texture), pose);
  EXPECT_GT(score, 0.97);
  EXPECT_GT(score, mirrored_texture + 0.01);
  EXPECT_GT(score, mirrored_head + 0.02);
  EXPECT_GT(score, flipped_texture + 0.02);
  RecordProperty("correlations", fmt::format("{:.4f}; mirrored texture {:.4f}, mirrored head {:.4f}, flipped {:.4f}",
                                             score, mirrored_texture, mirrored_head, flipped_texture));
}

}  // namespace
}  // namespace likeness
