#include "likeness/simulate/glb/glb_head.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <set>

#include "likeness/base/log.h"
#include "likeness/base/testing.h"
#include "likeness/simulate/gaze.h"
#include "likeness/simulate/glb/gltf_test_file.h"
#include "likeness/simulate/glb/triangles.h"

namespace likeness {
namespace {

using Eigen::Vector3f;
using testing::HasSubstr;
using Points = std::vector<std::array<float, 3>>;
using Triangles = std::vector<Eigen::Vector3i>;

constexpr float kEyeRadius = 0.012f;  // metres

// An ellipsoid, closed, in metres.
void MakeBall(const Vector3f& centre, const Vector3f& radii, int rows, Points* points, Triangles* triangles) {
  const int first = static_cast<int>(points->size()), columns = 2 * rows;
  const auto add = [&](const Vector3f& direction) {
    const Vector3f p = centre + radii.cwiseProduct(direction);
    points->push_back({p.x(), p.y(), p.z()});
  };
  add({0, 1, 0});
  for (int r = 1; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const float polar = std::numbers::pi_v<float> * static_cast<float>(r) / static_cast<float>(rows);
      const float around = 2 * std::numbers::pi_v<float> * static_cast<float>(c) / static_cast<float>(columns);
      add({std::sin(polar) * std::sin(around), std::cos(polar), std::sin(polar) * std::cos(around)});
    }
  }
  add({0, -1, 0});
  const int last = static_cast<int>(points->size()) - 1;
  const auto at = [&](int r, int c) { return first + 1 + (r - 1) * columns + c % columns; };
  for (int c = 0; c < columns; ++c) {
    triangles->emplace_back(first, at(1, c), at(1, c + 1));
    for (int r = 1; r + 1 < rows; ++r) {
      triangles->emplace_back(at(r, c), at(r + 1, c), at(r + 1, c + 1));
      triangles->emplace_back(at(r, c), at(r + 1, c + 1), at(r, c + 1));
    }
    triangles->emplace_back(at(rows - 1, c), last, at(rows - 1, c + 1));
  }
}

// A closed egg with eyeballs half sunk into it, without names; it blinks and opens its jaw (loosely).
GltfTestFile EggFile() {
  GltfTestFile file;
  Points head;
  Triangles triangles;
  MakeBall({0, 1.6f, 0}, {0.075f, 0.12f, 0.1f}, 60, &head, &triangles);
  Points jaw, blink_left, blink_right;
  for (const auto& p : head) {
    jaw.push_back({0, p[1] < 1.57f && p[2] > 0 ? -0.02f : 0, 0});
    const float to_left = std::hypot(p[0] - 0.03f, p[1] - 1.62f), to_right = std::hypot(p[0] + 0.03f, p[1] - 1.62f);
    blink_left.push_back({0, 0, to_left < 0.02f && p[2] > 0 ? 0.001f : 0});
    blink_right.push_back({0, 0, to_right < 0.02f && p[2] > 0 ? 0.001f : 0});
  }
  file.AddMesh("egg", head, triangles, {{"Egg_jawOpen", jaw}, {"eyeBlink_L", blink_left}, {"eyeBlink_R", blink_right}});
  for (const float x : {0.03f, -0.03f}) {
    Points ball;
    Triangles ball_triangles;
    MakeBall({x, 1.62f, 0.088f}, Vector3f::Constant(kEyeRadius), 12, &ball, &ball_triangles);
    file.AddNode({{"mesh", file.AddMesh("ball", ball, ball_triangles)}});
  }
  file.AddNode({{"mesh", 0}});
  return file;
}

std::unique_ptr<Head> OpenEgg(const GltfTestFile& file) { return ParseGlbHead("egg.glb", file.Bytes(), {}, ""); }

std::array<float, kExpressionCount> Weights(const std::vector<std::string>& names) {
  std::array<float, kExpressionCount> weights = {};
  for (const std::string& name : names) weights[ExpressionIndex(name)] = 1;
  return weights;
}

// One border, no overlap in the atlas, all triangles the same way round.
void ExpectGoodTrackedMesh(const MeshTopology& topology, float least_fill) {
  EXPECT_EQ(BorderLoops(topology.triangles).size(), 1u);
  double area = 0;
  for (const Eigen::Vector3i& t : topology.triangle_uvs) {
    const Eigen::Vector2d a = topology.uvs[t[0]].cast<double>(), b = topology.uvs[t[1]].cast<double>() - a,
                          c = topology.uvs[t[2]].cast<double>() - a;
    const double twice = b.x() * c.y() - b.y() * c.x();
    EXPECT_GT(twice, -1e-9);
    area += twice / 2;
  }
  constexpr int kSize = 1024;
  const TexelMap map = MapTexels(topology, kSize);
  double covered = 0;
  for (const TexelMap::Texel& texel : map.texels) covered += texel.triangle >= 0 ? 1.0 / (kSize * kSize) : 0;
  // Triangles that lie on each other would have more area than they cover.
  EXPECT_NEAR(area, covered, 0.002);
  EXPECT_GE(covered, least_fill);
}

class GlbHeadTest : public testing::Test {
 protected:
  void SetUp() override { SetQuiet(true); }
  void TearDown() override { SetQuiet(false); }
};

TEST_F(GlbHeadTest, FindsEyesAndOpensTheSkinAroundThem) {
  const auto head = OpenEgg(EggFile());
  EXPECT_EQ(head->name(), "egg.glb");
  ASSERT_EQ(head->surfaces().size(), 3u);
  ExpectGoodTrackedMesh(head->tracked_topology(), 0.95f);
  const PosedHead neutral = head->Pose(Weights({}));
  // In head space the eyes are level with the origin; patches cover them.
  int covering = 0;
  for (int v = 0; v < neutral.tracked.rows(); ++v) {
    for (const float x : {30.0f, -30.0f}) {
      const Vector3f eye(x, 0, 88);
      const Vector3f from_eye = Vector3f(neutral.tracked.row(v)) - eye;
      EXPECT_GT(from_eye.norm(), 11.5f);
      covering += from_eye.norm() < 18 && from_eye.z() > 8 ? 1 : 0;
    }
  }
  EXPECT_GT(covering, 20);
}

TEST_F(GlbHeadTest, TurnsEyesThatHaveNoShapesForIt) {
  const auto head = OpenEgg(EggFile());
  const PosedHead neutral = head->Pose(Weights({}));
  const auto weights = Weights({"eyeLookOutLeft"});
  const PosedHead posed = head->Pose(weights);
  const Eigen::Matrix3f gaze = GazeRotation(kLeft, weights);
  int turned = 0;
  for (size_t s = 0; s < posed.surfaces.size(); ++s) {
    if (head->surfaces()[s].name != "ball") continue;
    for (int v = 0; v < posed.surfaces[s].rows(); ++v) {
      const Vector3f before = neutral.surfaces[s].row(v), after = posed.surfaces[s].row(v);
      const Vector3f centre(30, 0, 88);
      const Vector3f expected = before.x() > 0 ? Vector3f(centre + gaze * (before - centre)) : before;
      EXPECT_LT((after - expected).norm(), 0.01f);
      ++turned;
    }
  }
  EXPECT_GT(turned, 100);
}

TEST_F(GlbHeadTest, MovesWithItsShapes) {
  const auto head = OpenEgg(EggFile());
  const PosedHead neutral = head->Pose(Weights({})), posed = head->Pose(Weights({"jawOpen"}));
  float lowest = 0;
  for (int v = 0; v < neutral.tracked.rows(); ++v) {
    lowest = std::min(lowest, posed.tracked(v, 1) - neutral.tracked(v, 1));
    const float wanted = neutral.tracked(v, 1) > 0 ? neutral.tracked(v, 1) : posed.tracked(v, 1);
    EXPECT_NEAR(posed.tracked(v, 1), wanted, 1e-3f);
  }
  EXPECT_NEAR(lowest, -20, 0.01f);
}

TEST_F(GlbHeadTest, SaysWhyAModelIsNoHead) {
  const auto error = [](const GltfTestFile& file) { return ErrorOf([&] { OpenEgg(file); }); };
  GltfTestFile still = EggFile();
  still.document["meshes"][0]["primitives"][0].erase("targets");
  EXPECT_THAT(error(still), HasSubstr("egg.glb: has no morph targets"));
  GltfTestFile nameless = EggFile();
  nameless.document["meshes"][0]["extras"]["targetNames"] = {"a", "b", "c"};
  EXPECT_THAT(error(nameless), HasSubstr("has 3 morph targets, but none is named like an ARKit expression"));
  GltfTestFile giant = EggFile();
  giant.AddNode({{"children", {0, 1, 2}}, {"scale", {40, 40, 40}}});
  giant.document["scenes"][0]["nodes"] = {3};
  EXPECT_THAT(error(giant), HasSubstr("expected a head in metres"));
  GltfTestFile behind = EggFile();
  behind.AddNode({{"children", {0, 1, 2}}, {"rotation", {0, 1, 0, 0}}});
  behind.document["scenes"][0]["nodes"] = {3};
  EXPECT_THAT(error(behind), HasSubstr("looks along -z"));
  GltfTestFile blind = EggFile();
  blind.document["scenes"][0]["nodes"] = {2};
  blind.document["meshes"][0]["extras"]["targetNames"] = {"jawOpen", "b", "c"};
  EXPECT_THAT(error(blind), HasSubstr("has no face that can be found"));
}

TEST_F(GlbHeadTest, TakesCentimetres) {
  GltfTestFile file = EggFile();
  file.AddNode({{"children", {0, 1, 2}}, {"scale", {100, 100, 100}}});
  file.document["scenes"][0]["nodes"] = {3};
  const Vertices metres = OpenEgg(EggFile())->Pose(Weights({})).tracked;
  const Vertices centimetres = OpenEgg(file)->Pose(Weights({})).tracked;
  ASSERT_EQ(metres.rows(), centimetres.rows());
  EXPECT_LT((metres - centimetres).cwiseAbs().maxCoeff(), 0.02f);
}

}  // namespace
}  // namespace likeness
