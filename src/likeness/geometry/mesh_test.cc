#include "likeness/geometry/mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/random.h"
#include "likeness/base/testing.h"

namespace likeness {
namespace {

using ::testing::HasSubstr;

// A square of two triangles that fills the UV range.
MeshTopology Square() {
  MeshTopology topology;
  topology.vertex_count = 4;
  topology.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  topology.triangles = {{0, 1, 2}, {0, 2, 3}};
  topology.triangle_uvs = topology.triangles;
  return topology;
}

TEST(MeshTopologyTest, CheckNamesWhatIsWrong) {
  MeshTopology topology = Square();
  EXPECT_EQ(ErrorOf([&] { topology.Check("x"); }), "");
  topology.triangles[1][2] = 4;
  EXPECT_THAT(ErrorOf([&] { topology.Check("x.obj"); }), HasSubstr("x.obj: triangle 1 refers to vertex 4"));
  topology = Square();
  topology.triangle_uvs.pop_back();
  EXPECT_THAT(ErrorOf([&] { topology.Check("x"); }), HasSubstr("2 triangles but 1"));
}

TEST(MapTexelsTest, EveryTexelOfACoveredSquareIsFoundWhereItLies) {
  const MeshTopology topology = Square();
  const int size = 37;
  const TexelMap map = MapTexels(topology, size);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const TexelMap::Texel& texel = map.at(x, y);
      ASSERT_GE(texel.triangle, 0);
      const Eigen::Vector3i& t = topology.triangle_uvs[texel.triangle];
      const Eigen::Vector2f uv = (1 - texel.b1 - texel.b2) * topology.uvs[t[0]] + texel.b1 * topology.uvs[t[1]] +
                                 texel.b2 * topology.uvs[t[2]];
      EXPECT_NEAR(uv.x(), (x + 0.5) / size, 1e-6);
      EXPECT_NEAR(uv.y(), 1 - (y + 0.5) / size, 1e-6);
    }
  }
}

TEST(MapTexelsTest, AgreesWithATestOfEveryTexelAgainstEveryTriangle) {
  Random random(5);
  MeshTopology topology;
  topology.vertex_count = 60;
  for (int i = 0; i < 60; ++i) topology.uvs.emplace_back(random.Uniform(-0.1, 1.1), random.Uniform(-0.1, 1.1));
  for (int i = 0; i < 60; i += 3) topology.triangles.emplace_back(i, i + 1, i + 2);
  topology.triangle_uvs = topology.triangles;
  const int size = 64;
  const TexelMap map = MapTexels(topology, size);
  int covered = 0;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const Eigen::Vector2d p((x + 0.5) / size, 1 - (y + 0.5) / size);
      int expected = -1;
      for (int t = 0; t < 20 && expected < 0; ++t) {
        const auto side = [&](int i) {
          const Eigen::Vector2d a = topology.uvs[3 * t + i].cast<double>();
          const Eigen::Vector2d b = topology.uvs[3 * t + (i + 1) % 3].cast<double>();
          return (b - a).x() * (p - a).y() - (b - a).y() * (p - a).x();
        };
        const double s0 = side(0), s1 = side(1), s2 = side(2);
        if ((s0 > 0 && s1 > 0 && s2 > 0) || (s0 < 0 && s1 < 0 && s2 < 0)) expected = t;
      }
      EXPECT_EQ(map.at(x, y).triangle, expected) << x << ' ' << y;
      covered += expected >= 0;
    }
  }
  EXPECT_GT(covered, 500);
}

TEST(VertexNormalsTest, PointOutwards) {
  Vertices vertices(4, 3);
  vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0;
  const Vertices normals = VertexNormals(vertices, Square().triangles);
  for (const auto& normal : normals.rowwise()) EXPECT_EQ(normal, Eigen::RowVector3f(0, 0, 1));
}

}  // namespace
}  // namespace likeness
