#include "likeness/train/texel_weights.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "likeness/base/error.h"
#include "likeness/render/rasterizer.h"

namespace likeness {
namespace {

constexpr int kSize = 60;

// Three squares beside each other, 100 mm a side: one faces the camera, one is further away, one is turned by 60
// degrees. Each has 16 of the texture's columns.
struct Scene {
  MeshTopology topology;
  Vertices vertices;
  Camera camera = LookAt({0, 0, 1000}, {0, 0, 0}, {0, 1, 0}, 1500, 640, 480);
  ImageU8 seen{kSize, kSize, 1, 255};

  Scene() {
    topology.vertex_count = 12;
    vertices.resize(12, 3);
    const std::array<Eigen::Vector3d, 3> centres = {{{-130, 0, 0}, {0, 0, -400}, {120, 0, 0}}};
    for (int square = 0; square < 3; ++square) {
      const Eigen::Matrix3d turn =
          Eigen::AngleAxisd(square == 2 ? M_PI / 3 : 0, Eigen::Vector3d::UnitX()).toRotationMatrix();
      for (int corner = 0; corner < 4; ++corner) {
        const double x = corner == 1 || corner == 2, y = corner >= 2;
        const Eigen::Vector3d point = centres[square] + turn * Eigen::Vector3d(100 * x - 50, 100 * y - 50, 0);
        vertices.row(4 * square + corner) = point.transpose().cast<float>();
        topology.uvs.emplace_back((20 * square + 2 + 16 * x) / kSize, y);
      }
      const int first = 4 * square;
      topology.triangles.emplace_back(first, first + 1, first + 2);
      topology.triangles.emplace_back(first, first + 2, first + 3);
    }
    topology.triangle_uvs = topology.triangles;
  }

  ImageF Weights(TexelWeighting weighting) const {
    ImageF weights(kSize, kSize, 1);
    TexelWeights(topology, kSize, weighting).Write(camera, {}, vertices, seen, weights.values().data());
    return weights;
  }

  // Sum of squared weights of a square's texels.
  double Sum(const ImageF& weights, int square) const {
    const TexelMap map = MapTexels(topology, kSize);
    double sum = 0;
    for (size_t i = 0; i < map.texels.size(); ++i) {
      if (map.texels[i].triangle / 2 == square && map.texels[i].triangle >= 0) sum += std::pow(weights.values()[i], 2);
    }
    return sum;
  }
};

double MeanSquare(const ImageF& weights) {
  double sum = 0;
  for (const float weight : weights.values()) sum += weight * weight;
  return sum / static_cast<double>(weights.values().size());
}

TEST(TexelWeights, AllIsTheMask) {
  Scene scene;
  scene.seen.at(3, 5)[0] = 0;
  const ImageF weights = scene.Weights(TexelWeighting::kAll);
  EXPECT_EQ(weights.at(3, 5)[0], 0);
  EXPECT_EQ(weights.at(5, 3)[0], 1);
}

TEST(TexelWeights, SeenCountsEveryTextureTheSame) {
  Scene scene;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < 45; ++x) scene.seen.at(x, y)[0] = 0;
  }
  const ImageF weights = scene.Weights(TexelWeighting::kSeen);
  EXPECT_NEAR(MeanSquare(weights), 1, 1e-5);
  EXPECT_EQ(weights.at(10, 10)[0], 0);
  EXPECT_NEAR(weights.at(50, 10)[0], 2, 1e-5) << "a quarter is seen";
}

TEST(TexelWeights, SquaresAreInProportionToPixels) {
  const Scene scene;
  const ImageF weights = scene.Weights(TexelWeighting::kPixels);
  EXPECT_NEAR(MeanSquare(weights), 1, 1e-5);
  const FragmentImage fragments = Rasterize(scene.vertices, scene.topology.triangles, scene.camera, {});
  std::array<double, 3> pixels = {};
  for (const Fragment& fragment : fragments.fragments) {
    if (fragment.triangle >= 0) ++pixels[fragment.triangle / 2];
  }
  ASSERT_GT(pixels[2], 5000);
  for (const int square : {1, 2}) {
    EXPECT_NEAR(scene.Sum(weights, square) / scene.Sum(weights, 0), pixels[square] / pixels[0],
                0.03 * pixels[square] / pixels[0])
        << square;
  }
}

TEST(TexelWeights, NothingSeenIsNothingAndBehindTheCameraCountsLeast) {
  Scene scene;
  std::fill(scene.seen.values().begin(), scene.seen.values().end(), uint8_t{0});
  EXPECT_EQ(MeanSquare(scene.Weights(TexelWeighting::kPixels)), 0);
  Scene behind;
  behind.vertices.row(0).z() = 2000;
  const ImageF weights = behind.Weights(TexelWeighting::kPixels);
  for (const float weight : weights.values()) EXPECT_TRUE(std::isfinite(weight) && weight > 0) << weight;
}

TEST(TexelWeights, UnknownNamesAreRefused) {
  for (const std::string& name : TexelWeightingNames()) ParseTexelWeighting(name);
  EXPECT_THROW(ParseTexelWeighting("some"), Error);
}

}  // namespace
}  // namespace likeness
