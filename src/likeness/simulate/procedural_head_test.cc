#include "likeness/simulate/procedural_head.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>

#include "likeness/base/testing.h"
#include "likeness/simulate/procedural_shape.h"

namespace likeness {
namespace {

std::array<float, kExpressionCount> Weights(const std::vector<std::string>& raised) {
  std::array<float, kExpressionCount> weights = {};
  for (const std::string& name : raised) weights[static_cast<size_t>(ExpressionIndex(name))] = 1;
  return weights;
}

// Every edge belongs to two triangles, which run through it in opposite directions.
TEST(ProceduralHeadTest, TheTrackedMeshIsClosedButForTheTwoPoles) {
  const auto head = MakeProceduralHead({.detail = 1});
  std::set<std::pair<int, int>> edges;
  for (const auto& t : head->tracked_topology().triangles) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_TRUE(edges.insert({t[k], t[(k + 1) % 3]}).second);
    }
  }
  int open = 0;
  for (const auto& [a, b] : edges) open += edges.count({b, a}) == 0 ? 1 : 0;
  EXPECT_EQ(open, 2 * 40);  // rings of points that coincide
  const PosedHead posed = head->Pose(Weights({}));
  EXPECT_LT((posed.tracked.row(0) - posed.tracked.row(20)).norm(), 1e-3);
}

TEST(ProceduralHeadTest, TheAtlasIsFullAndDoesNotOverlap) {
  const auto head = MakeProceduralHead({.detail = 1});
  const MeshTopology& topology = head->tracked_topology();
  topology.Check("procedural");
  const int size = 97;
  std::vector<int> covered(size * size);
  for (const Eigen::Vector3i& t : topology.triangle_uvs) {
    const Eigen::Vector2f a = topology.uvs[t[0]], b = topology.uvs[t[1]], c = topology.uvs[t[2]];
    const auto side = [](const Eigen::Vector2f& p, const Eigen::Vector2f& q, const Eigen::Vector2f& r) {
      return (q - p).x() * (r - p).y() - (q - p).y() * (r - p).x();
    };
    EXPECT_GT(side(a, b, c), 0) << "seen from outside, texture is not mirrored";
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const Eigen::Vector2f p((x + 0.5f) / size, (y + 0.5f) / size);
        if (side(a, b, p) > 1e-7f && side(b, c, p) > 1e-7f && side(c, a, p) > 1e-7f) ++covered[y * size + x];
      }
    }
  }
  int full = 0;
  for (const int count : covered) {
    EXPECT_LE(count, 1);
    full += count == 1 ? 1 : 0;
  }
  EXPECT_GT(full, 0.9 * size * size);
}

TEST(ProceduralHeadTest, NormalsPointOutAndSidesAreTheSubjectsOwn) {
  const auto head = MakeProceduralHead();
  const PosedHead posed = head->Pose(Weights({}));
  ASSERT_EQ(posed.surfaces.size(), head->surfaces().size());
  for (size_t s = 0; s < posed.surfaces.size(); ++s) {
    const Surface& surface = head->surfaces()[s];
    surface.topology.Check(surface.name);
    EXPECT_EQ(posed.surfaces[s].rows(), surface.topology.vertex_count);
    EXPECT_TRUE(posed.surfaces[s].allFinite());
    if (surface.name == "left eye") {
      EXPECT_GT(posed.surfaces[s].col(0).minCoeff(), 0);
    }
    if (surface.name == "right eye") {
      EXPECT_LT(posed.surfaces[s].col(0).maxCoeff(), 0);
    }
  }
  // The top of the head looks up, the foremost vertex forwards.
  Eigen::Index top = 0, nose = 0;
  posed.tracked.col(1).maxCoeff(&top);
  posed.tracked.col(2).maxCoeff(&nose);
  EXPECT_GT(posed.normals[0](nose, 2), 0.5);
  EXPECT_LT(std::abs(posed.tracked(nose, 0)), 3);
  EXPECT_GT(posed.tracked(top, 1), 100);
}

TEST(ProceduralHeadTest, ExpressionsMoveWhatTheirNamesSay) {
  const auto head = MakeProceduralHead();
  const auto vertex = [](double s, double t) {
    return static_cast<int>(std::lround(t * 72)) * 80 + static_cast<int>(std::lround(s * 80));
  };
  const PosedHead rest = head->Pose(Weights({}));
  const auto moved = [&](const std::vector<std::string>& names, int v) -> Eigen::RowVector3f {
    return head->Pose(Weights(names)).tracked.row(v) - rest.tracked.row(v);
  };
  const int lower_lip = vertex(0.5, kMouthRectangle.t0), upper_lip = vertex(0.5, kMouthRectangle.t1);
  EXPECT_LT(moved({"jawOpen"}, lower_lip).y(), -15);
  EXPECT_LT(moved({"jawOpen"}, upper_lip).norm(), 1);
  const int left_corner = vertex(kMouthRectangle.s1, 10.0 / 36), right_corner = vertex(kMouthRectangle.s0, 10.0 / 36);
  EXPECT_GT(moved({"mouthSmileLeft"}, left_corner).y(), 4);
  EXPECT_LT(moved({"mouthSmileLeft"}, right_corner).norm(), 1);
  EXPECT_LT(moved({"mouthFrownRight"}, right_corner).y(), -4);
  const int left_lid = vertex(25.0 / 40, kLeftEyeRectangle.t1), right_lid = vertex(15.0 / 40, kLeftEyeRectangle.t1);
  EXPECT_LT(moved({"eyeBlinkLeft"}, left_lid).y(), -4);
  EXPECT_LT(moved({"eyeBlinkLeft"}, right_lid).norm(), 1e-3);
  EXPECT_GT(moved({"browInnerUp"}, vertex(0.5, 23.0 / 36)).y(), 1);
  // A blink closes the lids but never crosses them.
  const PosedHead blink = head->Pose(Weights({"eyeBlinkLeft"}));
  const float gap = blink.tracked(left_lid, 1) - blink.tracked(vertex(25.0 / 40, kLeftEyeRectangle.t0), 1);
  EXPECT_GT(gap, -1e-3);
  EXPECT_LT(gap, 0.5);
  // An eye that looks up and to its outside: the pupil is the last row of its grid.
  const PosedHead look = head->Pose(Weights({"eyeLookOutLeft", "eyeLookUpLeft"}));
  const Eigen::RowVector3f pupil =
      look.surfaces[1].row(look.surfaces[1].rows() - 1) - rest.surfaces[1].row(rest.surfaces[1].rows() - 1);
  EXPECT_GT(pupil.x(), 3);
  EXPECT_GT(pupil.y(), 3);
}

TEST(ProceduralHeadTest, WrongOptionsAreErrors) {
  EXPECT_NE(ErrorOf([] { MakeProceduralHead({.texture_size = 0}); }), "");
  EXPECT_NE(ErrorOf([] { MakeProceduralHead({.detail = 100}); }), "");
}

}  // namespace
}  // namespace likeness
