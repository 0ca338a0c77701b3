// What is modelled and painted here: teeth, eyes, lashes, noise, pigments.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>

#include "likeness/simulate/human/brows.h"
#include "likeness/simulate/human/eye.h"
#include "likeness/simulate/human/lashes.h"
#include "likeness/simulate/human/noise.h"
#include "likeness/simulate/human/pigment.h"
#include "likeness/simulate/human/skin_regions.h"
#include "likeness/simulate/human/teeth.h"

namespace likeness {
namespace {

using Eigen::Vector3f;

// Six times the volume that triangles enclose, positive when they face outwards; exact for closed meshes.
double SixVolumes(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles) {
  double sum = 0;
  const Eigen::RowVector3f origin = vertices.colwise().mean();
  for (const Eigen::Vector3i& t : triangles) {
    const Eigen::RowVector3f a = vertices.row(t[0]) - origin, b = vertices.row(t[1]) - origin,
                             c = vertices.row(t[2]) - origin;
    sum += a.dot(b.cross(c));
  }
  return sum;
}

TEST(Teeth, FourteenCrownsFaceOutwardsInBothJaws) {
  for (const Jaw jaw : {Jaw::kUpper, Jaw::kLower}) {
    const JawMesh teeth = MakeTeeth(jaw);
    teeth.topology.Check("teeth");
    const size_t per_tooth = teeth.topology.triangles.size() / 14;
    for (size_t tooth = 0; tooth < 14; ++tooth) {
      const auto first = teeth.topology.triangles.begin() + static_cast<std::ptrdiff_t>(tooth * per_tooth);
      const std::vector<Eigen::Vector3i> triangles(first, first + static_cast<std::ptrdiff_t>(per_tooth));
      // About the tooth's own middle; open at the root, so the volume is a little wrong but its sign is not.
      Vertices own(3 * static_cast<Eigen::Index>(per_tooth), 3);
      std::vector<Eigen::Vector3i> renumbered;
      for (size_t t = 0; t < per_tooth; ++t) {
        const auto n = static_cast<int>(3 * t);
        for (int k = 0; k < 3; ++k) own.row(n + k) = teeth.vertices.row(triangles[t][k]);
        renumbered.emplace_back(n, n + 1, n + 2);
      }
      EXPECT_GT(SixVolumes(own, renumbered), 6 * 100) << "tooth " << tooth;
      EXPECT_LT(SixVolumes(own, renumbered), 6 * 1200) << "tooth " << tooth;
    }
    // Mirror images.
    EXPECT_NEAR(teeth.vertices.col(0).maxCoeff(), -teeth.vertices.col(0).minCoeff(), 1e-3);
    EXPECT_GT(teeth.vertices.col(0).maxCoeff(), 25);
  }
}

TEST(FollowAffinely, ReproducesAffineMapsExactly) {
  Vertices coarse = Vertices::Random(40, 3) * 30, points = Vertices::Random(10, 3) * 40;
  std::vector<int> helper;
  for (int i = 5; i < 30; ++i) helper.push_back(i);
  const Stencil stencil = FollowAffinely(points, coarse, helper);
  Eigen::Matrix3f matrix;
  matrix << 1.1f, 0.2f, 0, -0.1f, 0.9f, 0.3f, 0.05f, 0, 1;
  const Eigen::RowVector3f shift(10, -20, 5);
  const Vertices moved = (coarse * matrix).rowwise() + shift;
  const Vertices expected = (points * matrix).rowwise() + shift;
  const Vertices actual = stencil * moved;
  EXPECT_LT((actual - expected).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(Eye, CorneaBulgesOverTheIrisAndNowhereElse) {
  EXPECT_FLOAT_EQ(EyeReach(-1), 1);
  EXPECT_FLOAT_EQ(EyeReach(0), 1);
  EXPECT_NEAR(EyeReach(std::sqrt(1 - kLimbus * kLimbus)), 1, 1e-5) << "at the limbus";
  EXPECT_GT(EyeReach(1), 1.05f);
  EXPECT_LT(EyeReach(1), 1.2f);
  const EyeMesh ball = MakeEyeball(13), cornea = MakeCornea(13);
  ball.topology.Check("eyeball");
  cornea.topology.Check("cornea");
  for (int v = 0; v < cornea.vertices.rows(); ++v) {
    const float distance = cornea.vertices.row(v).norm();
    EXPECT_GT(distance, 13 * EyeReach(cornea.vertices(v, 2) / distance)) << "the film lies on the eye";
  }
  const Vertices normals = VertexNormals(ball.vertices, ball.topology.triangles);
  for (int v = 0; v < ball.vertices.rows(); ++v) EXPECT_GT(normals.row(v).dot(ball.vertices.row(v)), 0);
}

TEST(Noise, IsSmoothBoundedAndTheSameAgain) {
  double sum = 0, squares = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vector3f p(0.37f * static_cast<float>(i % 61), 0.23f * static_cast<float>(i % 97),
                     0.011f * static_cast<float>(i));
    const float value = GradientNoise(p, 9);
    EXPECT_LE(std::abs(value), 1.1f);
    EXPECT_EQ(value, GradientNoise(p, 9));
    EXPECT_NEAR(value, GradientNoise(p + Vector3f(1e-3f, 0, 0), 9), 5e-3);
    sum += value;
    squares += value * value;
    EXPECT_LE(FindNearestSpot(p, 9).distance, 1.5f);
  }
  EXPECT_NEAR(sum / 4000, 0, 0.05);
  EXPECT_GT(squares / 4000, 0.02);
  EXPECT_NE(GradientNoise({0.5f, 0.3f, 0.2f}, 1), GradientNoise({0.5f, 0.3f, 0.2f}, 2));
}

TEST(Pigment, MelaninDarkensAndBloodReddens) {
  float last = 1;
  for (float melanin = 0; melanin <= 1; melanin += 0.1f) {
    const Vector3f colour = SkinColour(melanin, 0.5f);
    EXPECT_LT(colour.sum(), 3 * last);
    EXPECT_GT(colour[0], colour[1]);
    EXPECT_GT(colour[1], colour[2]);
    last = colour.sum() / 3;
  }
  const Vector3f pale = SkinColour(0.2f, 0.2f), flushed = SkinColour(0.2f, 1.2f);
  EXPECT_GT(flushed[0] / flushed[1], pale[0] / pale[1]);
  EXPECT_LT(HairColour(1, 0, 0).maxCoeff(), HairColour(0.2f, 0, 0).minCoeff());
  EXPECT_EQ(EncodeSrgb(-1), 0);
  EXPECT_EQ(EncodeSrgb(2), 255);
  EXPECT_EQ(EncodeSrgb(0.2158605f), 128);
}

TEST(Regions, AreWhereTheyBelong) {
  const Vector3f crown(0, 118, -80), forehead(0, 45, 26), left_cheek(45, -30, 2), chin(0, -98, 24), nose(0, -37, 43),
      nape(0, -60, -150), ear(86, -15, -75);
  EXPECT_EQ(ScalpWeight(crown, 0.3f), 1);
  EXPECT_EQ(ScalpWeight(forehead, 0), 0);
  EXPECT_EQ(ScalpWeight(left_cheek, 0), 0);
  EXPECT_EQ(ScalpWeight(ear, 0), 0);
  EXPECT_LE(ScalpWeight({0, 75, 12}, 1), ScalpWeight({0, 75, 12}, 0));
  EXPECT_GT(BeardWeight(chin), 0.9f);
  EXPECT_EQ(BeardWeight(forehead), 0);
  EXPECT_EQ(BeardWeight(nape), 0);
  EXPECT_GT(CheekWeight(left_cheek), 0.5f);
  EXPECT_EQ(CheekWeight(nose), 0);
  EXPECT_GT(NoseTipWeight(nose), 0.7f);
  const BrowDrawing brows(RecipeFromSeed(1));
  double on_brow = 0, off_brow = 0;
  for (int i = -20; i <= 20; ++i) {
    on_brow += brows.Coverage({30 + 0.3f * static_cast<float>(i), 21.5f});
    off_brow += brows.Coverage({30 + 0.3f * static_cast<float>(i), 36});
  }
  EXPECT_GT(on_brow, 4);
  EXPECT_EQ(off_brow, 0);
  EXPECT_EQ(brows.Coverage({1e6f, -1e6f}), 0);
}

}  // namespace
}  // namespace likeness
