#include "likeness/geometry/proxy_mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <map>

#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/geometry/rigid.h"

namespace likeness {
namespace {

Eigen::MatrixX3d OnBall(int count) {
  Random random(8);
  Eigen::MatrixX3d points(count, 3);
  for (int i = 0; i < count; ++i) {
    points.row(i) << random.Normal(), random.Normal(), random.Normal();
    points.row(i).normalize();
  }
  return points;
}

TEST(EnclosingEllipsoid, FindsTheOneThatPointsLieOn) {
  const Eigen::Matrix3d turn = RotationFromYawPitchRoll(0.5, -0.3, 0.2);
  const Eigen::Matrix3d truth = turn * Eigen::Vector3d(90, 140, 110).asDiagonal() * turn.transpose();
  const Eigen::Vector3d centre(5, -20, 30);
  const Eigen::MatrixX3d points = (OnBall(2000) * truth).rowwise() + centre.transpose();
  const Ellipsoid found = EnclosingEllipsoid(points);
  EXPECT_LT((found.centre - centre).norm(), 1);
  EXPECT_LT((found.from_ball - truth).norm(), 0.02 * truth.norm());
  for (Eigen::Index i = 0; i < points.rows(); ++i) EXPECT_LE(found.RadiiOf(points.row(i)), 1 + 1e-12);
}

TEST(EnclosingEllipsoid, OfABoxTouchesItsCorners) {
  // The smallest around a box has the box's proportions and is the root of 3 larger.
  Eigen::MatrixX3d corners(8, 3);
  for (int i = 0; i < 8; ++i) corners.row(i) << (i & 1 ? 10 : -10), (i & 2 ? 40 : 0), (i & 4 ? 5 : -5);
  const Ellipsoid found = EnclosingEllipsoid(corners);
  const Eigen::Matrix3d truth = std::sqrt(3) * Eigen::Vector3d(10, 20, 5).asDiagonal().toDenseMatrix();
  EXPECT_LT((found.from_ball - truth).norm(), 0.01 * truth.norm());
  EXPECT_LT((found.centre - Eigen::Vector3d(0, 20, 0)).norm(), 0.1);
}

TEST(EnclosingEllipsoid, FlatPointsAreAnError) {
  EXPECT_NE(ErrorOf([] { EnclosingEllipsoid(OnBall(3)); }), "");
  Eigen::MatrixX3d flat = OnBall(50);
  flat.col(1).setConstant(4);
  EXPECT_NE(ErrorOf([&] { EnclosingEllipsoid(flat); }), "");
  EXPECT_NE(ErrorOf([&] { EnclosingEllipsoid(Eigen::MatrixX3d::Ones(9, 3)); }), "");
}

TEST(EllipsoidMesh, IsClosedContainsTheEllipsoidAndFacesOutwards) {
  Ellipsoid ellipsoid;
  ellipsoid.centre = {3, 4, 5};
  ellipsoid.from_ball = Eigen::Vector3d(80, 120, 100).asDiagonal();
  const ProxyMesh mesh = EllipsoidMesh(ellipsoid);
  mesh.topology.Check("mesh");
  std::map<std::pair<int, int>, int> edges;
  double most = 0;
  for (const Eigen::Vector3i& t : mesh.topology.triangles) {
    std::array<Eigen::Vector3d, 3> corners;
    for (int c = 0; c < 3; ++c) {
      ++edges[{t[c], t[(c + 1) % 3]}];
      corners[c] =
          ellipsoid.from_ball.inverse() * (mesh.vertices.row(t[c]).transpose().cast<double>() - ellipsoid.centre);
      most = std::max(most, corners[c].norm());
    }
    const Eigen::Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    EXPECT_GE(normal.dot(corners[0]), 1 - 1e-5);  // in float, of coordinates of 100 mm
  }
  EXPECT_LT(most, 1.02);  // close to it as well
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
  }
}

TEST(EllipsoidMesh, TheTextureHasTheFrontInItsMiddle) {
  Ellipsoid ball;
  const ProxyMesh mesh = EllipsoidMesh(ball);
  const TexelMap texels = MapTexels(mesh.topology, 64);
  const auto at = [&](int x, int y) -> Eigen::RowVector3f {
    const TexelMap::Texel& texel = texels.at(x, y);
    if (texel.triangle < 0) return Eigen::RowVector3f::Zero();
    const Eigen::Vector3i& t = mesh.topology.triangles[texel.triangle];
    return (1 - texel.b1 - texel.b2) * mesh.vertices.row(t[0]) + texel.b1 * mesh.vertices.row(t[1]) +
           texel.b2 * mesh.vertices.row(t[2]);
  };
  EXPECT_GT(at(32, 32).z(), 0.99);
  EXPECT_GT(at(52, 32).x(), 0.9);  // the subject's left
  EXPECT_LT(at(12, 32).x(), -0.9);
  EXPECT_GT(at(32, 4).y(), 0.9);  // row 0 is the top
  EXPECT_LT(at(1, 32).z(), -0.9);
  int front = 0, covered = 0;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      covered += texels.at(x, y).triangle >= 0;
      front += at(x, y).z() > 0;
    }
  }
  EXPECT_GT(covered, 64 * 62);
  EXPECT_NEAR(front / (64.0 * 64), 0.68, 0.02);
}

TEST(BillboardMesh, FacesTheFront) {
  const ProxyMesh mesh = BillboardMesh({-100, -150}, {120, 160}, 40);
  mesh.topology.Check("board");
  const Vertices normals = VertexNormals(mesh.vertices, mesh.topology.triangles);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(normals.row(i), Eigen::RowVector3f(0, 0, 1));
    EXPECT_EQ(mesh.vertices(i, 2), 40);
    EXPECT_EQ(mesh.vertices(i, 0), mesh.topology.uvs[i].x() == 0 ? -100 : 120);
    EXPECT_EQ(mesh.vertices(i, 1), mesh.topology.uvs[i].y() == 0 ? -150 : 160);
  }
}

}  // namespace
}  // namespace likeness
