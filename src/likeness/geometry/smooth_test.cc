#include "likeness/geometry/smooth.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/geometry/proxy_mesh.h"

namespace likeness {
namespace {

double Volume(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles) {
  double sum = 0;
  for (const Eigen::Vector3i& t : triangles) {
    Eigen::Matrix3d corners;
    for (int c = 0; c < 3; ++c) corners.row(c) = vertices.row(t[c]).cast<double>();
    sum += corners.determinant() / 6;
  }
  return sum;
}

// Of the distances to the origin.
double Roughness(const Vertices& vertices) {
  const Eigen::ArrayXd radii = vertices.cast<double>().rowwise().norm();
  return std::sqrt((radii - radii.mean()).square().mean());
}

Vertices Noisy(Vertices vertices, double deviation_mm) {
  Random random(3);
  for (Eigen::Index i = 0; i < vertices.rows(); ++i) {
    vertices.row(i) *= static_cast<float>(1 + deviation_mm * random.Normal() / vertices.row(i).norm());
  }
  return vertices;
}

TEST(TaubinSmooth, TakesNoiseFromABallAndKeepsItsVolume) {
  Ellipsoid ball;
  ball.from_ball *= 100;
  const ProxyMesh mesh = EllipsoidMesh(ball);
  const Vertices noisy = Noisy(mesh.vertices, 2);
  const Vertices smooth = TaubinSmooth(noisy, mesh.topology.triangles, {200});
  const double volume = Volume(mesh.vertices, mesh.topology.triangles);
  EXPECT_NEAR(Roughness(noisy), 2, 0.1);
  EXPECT_LT(Roughness(smooth), 0.5);
  EXPECT_NEAR(Volume(smooth, mesh.topology.triangles), volume, 0.01 * volume);
}

TEST(TaubinSmooth, FollowsItsTransferFunction) {
  // On a ring of n vertices waves are the frequencies k = 1 - cos(2 pi waves / n). A strip between two rings whose
  // borders are all there is has each of them as neighbours.
  constexpr int kAround = 60;
  std::vector<Eigen::Vector3i> triangles;
  Vertices vertices(2 * kAround, 3);
  for (int i = 0; i < kAround; ++i) {
    const int next = (i + 1) % kAround;
    triangles.emplace_back(i, next, kAround + i);
    triangles.emplace_back(next, kAround + next, kAround + i);
    for (const int row : {i, kAround + i}) {
      vertices.row(row) << static_cast<float>(std::cos(2 * M_PI * 2 * i / kAround)),
          static_cast<float>(std::cos(2 * M_PI * 9 * i / kAround)), row < kAround ? 0.0f : 1.0f;
    }
  }
  TaubinOptions options;
  options.iterations = 7;
  options.pass_band = 0.1;
  const Vertices smooth = TaubinSmooth(vertices, triangles, options);
  const double lambda = options.shrink, mu = 1 / (options.pass_band - 1 / lambda);
  for (const int axis : {0, 1}) {
    const double k = 1 - std::cos(2 * M_PI * (axis == 0 ? 2 : 9) / kAround);
    const double gain = std::pow((1 - lambda * k) * (1 - mu * k), options.iterations);
    for (int i = 0; i < 2 * kAround; ++i) {
      EXPECT_NEAR(smooth(i, axis), gain * vertices(i, axis), 1e-5) << i;
      EXPECT_EQ(smooth(i, 2), vertices(i, 2));  // the borders do not pull at each other
    }
  }
}

TEST(TaubinSmooth, VerticesWithoutATriangleStay) {
  Vertices vertices(5, 3);
  vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0, 7, 8, 9, 1, 1, 3;
  const Vertices smooth = TaubinSmooth(vertices, {{0, 1, 2}, {1, 4, 2}, {0, 0, 1}}, {3});
  EXPECT_EQ(smooth.row(3), vertices.row(3));
  EXPECT_TRUE(smooth.allFinite());
  EXPECT_NE(ErrorOf([&] { TaubinSmooth(vertices, {}, {-1}); }), "");
}

}  // namespace
}  // namespace likeness
