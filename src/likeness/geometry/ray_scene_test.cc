#include "likeness/geometry/ray_scene.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "likeness/base/random.h"

namespace likeness {
namespace {

// Moeller and Trumbore, in double precision, against every triangle.
RayHit BruteForce(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles, const Ray& ray,
                  bool one_sided) {
  RayHit nearest;
  nearest.t = ray.t_max;
  for (size_t i = 0; i < triangles.size(); ++i) {
    const Eigen::Vector3d a = vertices.row(triangles[i][0]).transpose().cast<double>();
    const Eigen::Vector3d e1 = vertices.row(triangles[i][1]).transpose().cast<double>() - a;
    const Eigen::Vector3d e2 = vertices.row(triangles[i][2]).transpose().cast<double>() - a;
    const Eigen::Vector3d d = ray.direction.cast<double>(), s = ray.origin.cast<double>() - a;
    const double determinant = e1.dot(d.cross(e2));
    if (determinant == 0 || (one_sided && e1.cross(e2).dot(d) > 0)) continue;
    const double b1 = s.dot(d.cross(e2)) / determinant, b2 = d.dot(s.cross(e1)) / determinant;
    const double t = e2.dot(s.cross(e1)) / determinant;
    if (b1 < 0 || b2 < 0 || b1 + b2 > 1 || t < ray.t_min || t > nearest.t) continue;
    nearest = {0, static_cast<int>(i), static_cast<float>(t), static_cast<float>(b1), static_cast<float>(b2)};
  }
  return nearest;
}

class RaySceneTest : public ::testing::TestWithParam<bool> {};

TEST_P(RaySceneTest, AgreesWithBruteForce) {
  const bool one_sided = GetParam();
  Random random(1);
  Vertices vertices(90, 3);
  for (auto& x : vertices.reshaped()) x = static_cast<float>(random.Uniform(-1, 1));
  std::vector<Eigen::Vector3i> triangles;
  for (int i = 0; i < 90; i += 3) triangles.emplace_back(i, i + 1, i + 2);
  RayScene scene;
  scene.Add(vertices, triangles, one_sided);
  scene.Build();
  std::vector<Ray> rays;
  int hits = 0, disagreements = 0;
  for (int i = 0; i < 1600; ++i) {
    Ray ray;
    for (float& x : ray.origin) x = static_cast<float>(random.Uniform(-2, 2));
    for (float& x : ray.direction) x = static_cast<float>(random.Normal());
    const RayHit expected = BruteForce(vertices, triangles, ray, one_sided), hit = scene.Intersect(ray);
    disagreements += hit.triangle != expected.triangle;
    if (hit.triangle == expected.triangle && hit.triangle >= 0) {
      ++hits;
      EXPECT_NEAR(hit.t, expected.t, 1e-4 * (1 + std::abs(expected.t)));
      EXPECT_NEAR(hit.b1, expected.b1, 1e-3);
      EXPECT_NEAR(hit.b2, expected.b2, 1e-3);
    }
    EXPECT_EQ(scene.Occluded(ray), hit.triangle >= 0);
    rays.push_back(ray);
    if (rays.size() == 16) {
      const uint32_t occluded = scene.Occluded16(rays);
      std::vector<RayHit> packet(16);
      scene.Intersect16(rays, packet);
      for (int k = 0; k < 16; ++k) {
        EXPECT_EQ((occluded >> k) & 1, scene.Occluded(rays[k]) ? 1u : 0u);
        const RayHit single = scene.Intersect(rays[k]);
        EXPECT_EQ(packet[k].triangle, single.triangle);
        EXPECT_EQ(packet[k].mesh, single.mesh);
        if (single.triangle < 0) continue;
        EXPECT_NEAR(packet[k].t, single.t, 1e-5 * (1 + single.t));
        EXPECT_NEAR(packet[k].b1, single.b1, 1e-4);
        EXPECT_NEAR(packet[k].b2, single.b2, 1e-4);
      }
      rays.clear();
    }
  }
  EXPECT_GT(hits, 100);
  EXPECT_LE(disagreements, 1);  // a ray through an edge may fall on either side
}

INSTANTIATE_TEST_SUITE_P(Sides, RaySceneTest, ::testing::Bool());

}  // namespace
}  // namespace likeness
