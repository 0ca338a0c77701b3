#include "likeness/simulate/human/human_head.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <functional>
#include <map>
#include <set>

#include "likeness/base/file.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/geometry/ray_scene.h"
#include "likeness/simulate/human/base_mesh.h"

namespace likeness {
namespace {

using Weights = std::array<float, kExpressionCount>;

HumanRecipe SmallRecipe(uint64_t seed) {
  HumanRecipe recipe = RecipeFromSeed(seed);
  recipe.texture_size = 256;
  return recipe;
}

class HumanHeadTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (const auto data = HeadData()) head_ = MakeHumanHead(*data, SmallRecipe(3));
  }
  static void TearDownTestSuite() { head_.reset(); }
  void SetUp() override {
    if (!head_) GTEST_SKIP() << "head data absent";
  }

  static Weights With(std::initializer_list<std::pair<const char*, float>> set) {
    Weights weights = {};
    for (const auto& [name, value] : set) weights[ExpressionIndex(name)] = value;
    return weights;
  }
  static size_t SurfaceIndex(const std::string& name) {
    for (size_t i = 0; i < head_->surfaces().size(); ++i) {
      if (head_->surfaces()[i].name == name) return i;
    }
    ADD_FAILURE() << "no surface " << name;
    return 0;
  }

  static inline std::unique_ptr<Head> head_;
};

TEST_F(HumanHeadTest, HasSoundSurfacesWithinTheHead) {
  const PosedHead posed = head_->Pose(Weights{});
  ASSERT_EQ(posed.surfaces.size(), head_->surfaces().size());
  ASSERT_EQ(posed.normals.size(), head_->surfaces().size());
  for (size_t i = 0; i < posed.surfaces.size(); ++i) {
    const Surface& surface = head_->surfaces()[i];
    surface.topology.Check(surface.name);
    EXPECT_EQ(posed.surfaces[i].rows(), surface.topology.vertex_count) << surface.name;
    EXPECT_TRUE(posed.surfaces[i].allFinite()) << surface.name;
    EXPECT_FALSE(surface.material.albedo.empty()) << surface.name;
    EXPECT_LT(posed.surfaces[i].cwiseAbs().maxCoeff(), 160) << surface.name;
  }
  // Face and skull lie about the centre.
  const Vertices& skin = posed.surfaces[SurfaceIndex("skin")];
  EXPECT_NEAR(skin.col(2).maxCoeff(), 115, 20);
  EXPECT_NEAR(skin.col(1).maxCoeff(), 115, 20);
  EXPECT_NEAR(skin.col(0).maxCoeff() + skin.col(0).minCoeff(), 0, 6);
}

TEST_F(HumanHeadTest, SkinIsPaintedEverywhereAndReliefIsGentle) {
  const size_t skin = SurfaceIndex("skin");
  const Material& material = head_->surfaces()[skin].material;
  const TexelMap map = MapTexels(head_->surfaces()[skin].topology, material.albedo.width());
  double up = 0;
  int painted = 0;
  for (int y = 0; y < map.size; ++y) {
    for (int x = 0; x < map.size; ++x) {
      if (map.at(x, y).triangle < 0) continue;
      ++painted;
      EXPECT_GT(material.albedo.at(x, y)[0], 0);
      const Eigen::Map<const Eigen::Vector3f> normal(material.normal_map.at(x, y));
      ASSERT_NEAR(normal.norm(), 1, 1e-4);
      ASSERT_GT(normal.z(), 0);
      up += normal.z();
    }
  }
  EXPECT_GT(up / painted, 0.95);
  for (const Surface& surface : head_->surfaces()) {
    if (surface.name.ends_with("cornea")) {
      EXPECT_TRUE(surface.material.transparent);
      EXPECT_EQ(surface.material.coat, 1);
    }
  }
}

TEST_F(HumanHeadTest, TrackedMeshHasAboutSevenThousandVerticesAndOneBorder) {
  const MeshTopology& topology = head_->tracked_topology();
  EXPECT_NEAR(topology.vertex_count, 7000, 10);
  EXPECT_GT(topology.uvs.size(), static_cast<size_t>(topology.vertex_count)) << "there are seams";
  std::set<int> used;
  std::map<std::pair<int, int>, int> directed;
  for (const Eigen::Vector3i& t : topology.triangles) {
    for (int k = 0; k < 3; ++k) {
      used.insert(t[k]);
      ++directed[{t[k], t[(k + 1) % 3]}];
    }
  }
  EXPECT_EQ(static_cast<int>(used.size()), topology.vertex_count);
  // Neighbours run along a shared edge in opposite directions; the only edges with one triangle are those round the cut
  // through the neck: no crack at lids, lips, or where fine meets coarse.
  const Vertices rest = head_->Pose(Weights{}).tracked;
  int border = 0;
  for (const auto& [edge, count] : directed) {
    ASSERT_EQ(count, 1);
    if (directed.contains({edge.second, edge.first})) continue;
    ++border;
    EXPECT_LT(rest(edge.first, 1), -85);
  }
  EXPECT_EQ(border, 46);
}

TEST_F(HumanHeadTest, AtlasHasNoOverlapIsFullAndKeepsChartsApart) {
  const MeshTopology& topology = head_->tracked_topology();
  constexpr int kSize = 512;
  // Triangles are counted at points that no edge hits.
  std::vector<int> count(kSize * kSize, 0);
  for (size_t t = 0; t < topology.triangles.size(); ++t) {
    Eigen::Vector2d p[3];
    for (int k = 0; k < 3; ++k) p[k] = topology.uvs[topology.triangle_uvs[t][k]].cast<double>() * kSize;
    const Eigen::Vector2d e1 = p[1] - p[0], e2 = p[2] - p[0];
    const double area = e1.x() * e2.y() - e1.y() * e2.x();
    EXPECT_GT(area, 0) << "triangle " << t << " is turned over in the atlas, or has no area";
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(p[k].minCoeff(), 1);
      EXPECT_LE(p[k].maxCoeff(), kSize - 1);
    }
    const int x0 = static_cast<int>(std::min({p[0].x(), p[1].x(), p[2].x()})),
              x1 = static_cast<int>(std::max({p[0].x(), p[1].x(), p[2].x()}));
    const int y0 = static_cast<int>(std::min({p[0].y(), p[1].y(), p[2].y()})),
              y1 = static_cast<int>(std::max({p[0].y(), p[1].y(), p[2].y()}));
    for (int y = y0; y <= std::min(y1, kSize - 1); ++y) {
      for (int x = x0; x <= std::min(x1, kSize - 1); ++x) {
        const Eigen::Vector2d d = Eigen::Vector2d(x + 0.5123, y + 0.4871) - p[0];
        const double b1 = (d.x() * e2.y() - d.y() * e2.x()) / area, b2 = (e1.x() * d.y() - e1.y() * d.x()) / area;
        if (b1 > 1e-9 && b2 > 1e-9 && b1 + b2 < 1 - 1e-9) ++count[y * kSize + x];
      }
    }
  }
  int covered = 0, most = 0;
  for (const int c : count) {
    covered += c > 0;
    most = std::max(most, c);
  }
  EXPECT_EQ(most, 1);
  EXPECT_GE(covered, kSize * kSize * 2 / 3);

  // Charts: triangles joined by shared texture coordinates. Texels of different ones are more than two apart.
  std::vector<int> parent(topology.uvs.size());
  for (size_t i = 0; i < parent.size(); ++i) parent[i] = static_cast<int>(i);
  const std::function<int(int)> root = [&](int i) { return parent[i] == i ? i : parent[i] = root(parent[i]); };
  for (const Eigen::Vector3i& t : topology.triangle_uvs) {
    parent[root(t[1])] = root(t[0]);
    parent[root(t[2])] = root(t[0]);
  }
  const TexelMap map = MapTexels(topology, kSize);
  const auto chart = [&](int x, int y) {
    const int t = map.at(x, y).triangle;
    return t < 0 ? -1 : root(topology.triangle_uvs[t][0]);
  };
  std::set<int> charts;
  for (int y = 2; y < kSize - 2; ++y) {
    for (int x = 2; x < kSize - 2; ++x) {
      const int here = chart(x, y);
      if (here < 0) continue;
      charts.insert(here);
      for (const auto& [dx, dy] : {std::pair(2, 0), std::pair(0, 2), std::pair(2, 2), std::pair(-2, 2)}) {
        const int there = chart(x + dx, y + dy);
        ASSERT_TRUE(there < 0 || there == here) << x << " " << y;
      }
    }
  }
  EXPECT_EQ(charts.size(), 2u) << "face and mouth";
}

TEST_F(HumanHeadTest, TrackedTrianglesFaceOutwards) {
  const MeshTopology& topology = head_->tracked_topology();
  const Vertices rest = head_->Pose(Weights{}).tracked;
  // The enclosed volume is positive, and from the front the nearest surface is never seen from behind.
  RayScene scene;
  scene.Add(rest, topology.triangles);
  scene.Build();
  int hits = 0;
  for (float y = -70; y < 100; y += 4) {
    for (float x = -60; x <= 60; x += 4) {
      const RayHit hit = scene.Intersect({.origin = {x, y, 300}, .direction = {0, 0, -1}});
      if (hit.mesh < 0) continue;
      ++hits;
      const Eigen::Vector3i& t = topology.triangles[hit.triangle];
      const Eigen::RowVector3f a = rest.row(t[1]) - rest.row(t[0]), b = rest.row(t[2]) - rest.row(t[0]);
      EXPECT_GT(a.cross(b).z(), 0) << x << " " << y;
    }
  }
  EXPECT_GT(hits, 800);
}

// From the front, between the lids, the patch is what a ray meets first, just before the eyeball.
TEST_F(HumanHeadTest, EyePatchesLieBetweenTheLidsJustBeforeTheEyes) {
  for (const Weights& weights :
       {Weights{}, With({{"eyeLookUpLeft", 1}, {"eyeLookUpRight", 1}}), With({{"eyeWideLeft", 1}, {"eyeWideRight", 1}}),
        With({{"eyeLookOutLeft", 1}, {"eyeLookInRight", 1}}),
        With({{"eyeBlinkLeft", 0.5f}, {"eyeBlinkRight", 0.5f}})}) {
    const PosedHead posed = head_->Pose(weights);
    RayScene tracked, eye;
    tracked.Add(posed.tracked, head_->tracked_topology().triangles);
    tracked.Build();
    for (const char* name : {"left eye", "right eye"}) {
      const size_t i = SurfaceIndex(name);
      eye.Add(posed.surfaces[i], head_->surfaces()[i].topology.triangles);
    }
    eye.Build();
    int rays = 0;
    for (const float side : {-1.0f, 1.0f}) {
      for (float y = -20; y < 20; y += 0.5f) {
        for (float x = 15; x < 50; x += 0.5f) {
          const Ray ray{.origin = {side * x, y, 300}, .direction = {0, 0, -1}};
          const RayHit skin = tracked.Intersect(ray), ball = eye.Intersect(ray);
          if (ball.mesh < 0) continue;
          ++rays;
          ASSERT_GE(skin.mesh, 0);
          EXPECT_LT(skin.t, ball.t + 0.25f) << "the eyeball shows through at " << side * x << " " << y;
        }
      }
    }
    EXPECT_GT(rays, 500);
  }
}

TEST_F(HumanHeadTest, ABlinkClosesThePatches) {
  const MeshTopology& topology = head_->tracked_topology();
  const int first_patch_vertex = topology.vertex_count - 2 * 27 * 7;  // those between the lids are the last
  // How many rays from the front meet a patch first, left and right of the subject.
  const auto visible = [&](const Weights& weights) {
    RayScene scene;
    scene.Add(head_->Pose(weights).tracked, topology.triangles);
    scene.Build();
    std::array<int, 2> count = {};
    for (float y = -25; y < 25; y += 0.5f) {
      for (float x = -55; x < 55; x += 0.5f) {
        const RayHit hit = scene.Intersect({.origin = {x, y, 300}, .direction = {0, 0, -1}});
        if (hit.mesh >= 0 && topology.triangles[hit.triangle].maxCoeff() >= first_patch_vertex) ++count[x > 0 ? 0 : 1];
      }
    }
    return count;
  };
  const auto open = visible(Weights{}), blink = visible(With({{"eyeBlinkLeft", 1}, {"eyeBlinkRight", 1}})),
             wink = visible(With({{"eyeBlinkLeft", 1}}));
  for (const int side : {0, 1}) {
    EXPECT_GT(open[side], 500);
    EXPECT_LT(blink[side], 0.02 * open[side]);
  }
  EXPECT_LT(wink[0], 0.02 * open[0]);
  EXPECT_GT(wink[1], 0.9 * open[1]);
}

TEST_F(HumanHeadTest, SkinIsLinearInTheWeightsAwayFromTheEyes) {
  Random random(5);
  Weights a = {}, b = {}, sum = {};
  for (int k = 0; k < kExpressionCount; ++k) {
    a[k] = static_cast<float>(0.5 * random.Uniform());
    b[k] = static_cast<float>(0.5 * random.Uniform());
    sum[k] = a[k] + b[k];
  }
  for (const char* name : {"skin", "tongue", "lower teeth"}) {
    const size_t i = SurfaceIndex(name);
    const Vertices rest = head_->Pose(Weights{}).surfaces[i];
    const Vertices expected = head_->Pose(a).surfaces[i] + head_->Pose(b).surfaces[i] - rest;
    const Vertices actual = head_->Pose(sum).surfaces[i];
    int checked = 0;
    for (int v = 0; v < rest.rows(); ++v) {
      const bool near_eye = std::abs(rest(v, 1)) < 25 && rest(v, 2) > 30 && std::abs(rest(v, 0)) < 60;
      if (near_eye) continue;
      ++checked;
      EXPECT_LT((actual.row(v) - expected.row(v)).norm(), 1e-3) << name << " " << v;
    }
    EXPECT_GT(checked, rest.rows() / 2);
  }
}

TEST_F(HumanHeadTest, LidsNeverCutIntoTheEyes) {
  for (const float blink : {0.25f, 0.5f, 0.75f, 1.0f}) {
    const PosedHead posed = head_->Pose(With({{"eyeBlinkLeft", blink}, {"eyeBlinkRight", blink}}));
    const Vertices& skin = posed.surfaces[SurfaceIndex("skin")];
    for (const char* name : {"left eye", "right eye"}) {
      const Vertices& eye = posed.surfaces[SurfaceIndex(name)];
      // The eye's centre: its widest ring lies in its plane.
      const Eigen::RowVector3f centre((eye.col(0).maxCoeff() + eye.col(0).minCoeff()) / 2,
                                      (eye.col(1).maxCoeff() + eye.col(1).minCoeff()) / 2, 0);
      const float radius = (eye.col(0).maxCoeff() - eye.col(0).minCoeff()) / 2;
      Eigen::RowVector3f middle = centre;
      middle.z() = eye.col(2).minCoeff() + radius * 0.5f;  // the ball is cut at 120 degrees: cos = -1/2
      for (int v = 0; v < skin.rows(); ++v) EXPECT_GT((skin.row(v) - middle).norm(), 0.99f * radius);
    }
  }
}

TEST_F(HumanHeadTest, JawTakesLowerTeethAndTongueAlong) {
  const PosedHead rest = head_->Pose(Weights{}), open = head_->Pose(With({{"jawOpen", 1}}));
  const auto drop = [&](const char* name) {
    const size_t i = SurfaceIndex(name);
    return (rest.surfaces[i] - open.surfaces[i]).col(1).mean();
  };
  EXPECT_GT(drop("lower teeth"), 8);
  EXPECT_GT(drop("tongue"), 3);
  EXPECT_NEAR(drop("upper teeth"), 0, 1e-3);
}

TEST_F(HumanHeadTest, EyesTurnTheRightWay) {
  const auto iris = [&](const char* name, const Weights& weights) {
    return Eigen::RowVector3f(head_->Pose(weights).surfaces[SurfaceIndex(name)].bottomRows(1));  // the pupil's centre
  };
  const auto rest = iris("left eye", Weights{});
  EXPECT_GT(iris("left eye", With({{"eyeLookOutLeft", 1}})).x(), rest.x() + 4);
  EXPECT_LT(iris("left eye", With({{"eyeLookInLeft", 1}})).x(), rest.x() - 4);
  EXPECT_GT(iris("left eye", With({{"eyeLookUpLeft", 1}})).y(), rest.y() + 3);
  EXPECT_LT(iris("left eye", With({{"eyeLookDownLeft", 1}})).y(), rest.y() - 3);
  EXPECT_LT(iris("right eye", With({{"eyeLookOutRight", 1}})).x(), iris("right eye", Weights{}).x() - 4);
}

TEST_F(HumanHeadTest, SeedsDecideThePersonAndTopologyIsTheSameForAll) {
  const auto again = MakeHumanHead(*HeadData(), SmallRecipe(3)), other = MakeHumanHead(*HeadData(), SmallRecipe(4));
  const PosedHead a = head_->Pose(Weights{}), b = again->Pose(Weights{}), c = other->Pose(Weights{});
  EXPECT_EQ(a.tracked, b.tracked);
  for (size_t i = 0; i < a.surfaces.size(); ++i) {
    EXPECT_EQ(a.surfaces[i], b.surfaces[i]);
    EXPECT_TRUE(head_->surfaces()[i].material.albedo == again->surfaces()[i].material.albedo);
  }
  EXPECT_GT((a.tracked - c.tracked).rowwise().norm().mean(), 0.5f) << "mm";
  EXPECT_EQ(head_->tracked_topology().triangles, other->tracked_topology().triangles);
  EXPECT_EQ(head_->tracked_topology().uvs, other->tracked_topology().uvs);
}

TEST(HumanHead, MissingOrOtherDataAreErrorsThatNameTheFile) {
  const ScratchFolder folder;
  EXPECT_NE(ErrorOf([&] { MakeHumanHead(folder.path(), HumanRecipe{}); }).find("base.obj"), std::string::npos);
  WriteFile(folder / "mpfb2/3dobjs/base.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\ng body\nf 1/1 2/1 3/1\n");
  EXPECT_NE(ErrorOf([&] { ReadBaseMesh(folder.path()); }).find("expected MakeHuman's base mesh"), std::string::npos);
  WriteFile(folder / "mpfb2/3dobjs/base.obj", "v 0 7 0\nv 1 7 0\nv 0 1 0\nvt 0 0\ng other\nf 1/1 2/1 3/1\n");
  EXPECT_NE(ErrorOf([&] { ReadBaseMesh(folder.path()); }).find("has 0 quads in the face and neck"), std::string::npos);
}

}  // namespace
}  // namespace likeness
