#include "likeness/simulate/human/subdivide.h"

#include <gtest/gtest.h>

#include "likeness/geometry/mesh.h"

namespace likeness {
namespace {

// A grid of n x n quads in the plane z = 0.
std::vector<Quad> Grid(int n) {
  std::vector<Quad> quads;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const int a = y * (n + 1) + x;
      quads.push_back({a, a + 1, a + n + 2, a + n + 1});
    }
  }
  return quads;
}

Vertices GridPoints(int n) {
  Vertices points((n + 1) * (n + 1), 3);
  for (int i = 0; i < points.rows(); ++i) {
    const int column = i % (n + 1), row = i / (n + 1);
    points.row(i) << static_cast<float>(column), static_cast<float>(row), 0;
  }
  return points;
}

TEST(Subdivide, CountsEdgesAndKeepsOrientation) {
  const Subdivision s = Subdivide(Grid(3), 16);
  EXPECT_EQ(s.edges.size(), 24u);
  EXPECT_EQ(s.fine_count, 16 + 24 + 9);
  EXPECT_EQ(s.quads.size(), 36u);
  const Vertices fine = CatmullClark(s) * GridPoints(3);
  for (const Quad& q : s.quads) {
    const Eigen::RowVector3f a = fine.row(q[1]) - fine.row(q[0]), b = fine.row(q[3]) - fine.row(q[0]);
    EXPECT_GT(a.x() * b.y() - a.y() * b.x(), 0);
  }
}

TEST(CatmullClark, RowsSumToOneAndAFlatRegularGridStaysInPlace) {
  const Subdivision s = Subdivide(Grid(4), 25);
  const Stencil stencil = CatmullClark(s);
  const Eigen::VectorXf sums = stencil * Eigen::VectorXf::Ones(25);
  for (int i = 0; i < sums.size(); ++i) EXPECT_NEAR(sums[i], 1, 1e-6);
  const Vertices coarse = GridPoints(4);
  const Vertices fine = stencil * coarse;
  EXPECT_LT((fine.row(12) - coarse.row(12)).norm(), 1e-6) << "an inner vertex of a regular grid";
}

// A cube's vertex goes to 5/9 of its place after one step: F = 1/3 (1,1,1), R = 2/3 (1,1,1), n = 3, so
// (F + 2 R + 0 P) / 3 = 5/9.
TEST(CatmullClark, TakesACubeTowardsASphere) {
  Vertices cube(8, 3);
  for (int i = 0; i < 8; ++i) cube.row(i) << (i & 1 ? 1.f : -1.f), (i & 2 ? 1.f : -1.f), (i & 4 ? 1.f : -1.f);
  const std::vector<Quad> quads = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  const Subdivision s = Subdivide(quads, 8);
  const Vertices fine = CatmullClark(s) * cube;
  for (int i = 0; i < 8; ++i) EXPECT_LT((fine.row(i) - cube.row(i) * (5.f / 9)).norm(), 1e-6);
  // Edge points are the mean of two ends and two face points, (1, 1, 0) x 3/4; face points keep distance 1.
  for (int i = 8; i < 20; ++i) EXPECT_NEAR(fine.row(i).norm(), 0.75f * std::sqrt(2.f), 1e-6);
  for (int i = 20; i < 26; ++i) EXPECT_NEAR(fine.row(i).norm(), 1, 1e-6);
}

}  // namespace
}  // namespace likeness
