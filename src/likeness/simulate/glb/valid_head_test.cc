// The VALID avatars of the sample data (MIT) as heads. Their conversion by others (neutral.obj, shapes.f16) is the
// truth.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <set>

#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/testing.h"
#include "likeness/base/text.h"
#include "likeness/geometry/obj.h"
#include "likeness/simulate/glb/closed_surface.h"
#include "likeness/simulate/glb/gltf_scene.h"
#include "likeness/simulate/glb/surface_atlas.h"
#include "likeness/simulate/glb/triangles.h"

namespace likeness {
namespace {

using Eigen::Vector3f;
namespace fs = std::filesystem;

float FromHalf(uint16_t half) {
  const int exponent = (half >> 10) & 31, fraction = half & 1023;
  const float value = exponent == 0 ? std::ldexp(static_cast<float>(fraction), -24)
                                    : std::ldexp(static_cast<float>(fraction + 1024), exponent - 25);
  return (half & 0x8000) != 0 ? -value : value;
}

// The conversion: positions in metres, moved; displacements of its vertices, shape by shape.
struct Truth {
  explicit Truth(const fs::path& folder)
      : obj(ReadObj(folder / "neutral.obj")), bytes(ReadFile(folder / "shapes.f16")) {
    const std::string text = ReadFile(folder / "shapes.txt");
    TextLines lines("shapes.txt", text);
    while (lines.Next()) {
      if (!Trim(lines.line()).empty()) names.emplace_back(Trim(lines.line()));
    }
  }
  std::vector<int> VerticesOfGroup(const std::string& name) const {
    std::set<int> vertices;
    for (const ObjPolygon& polygon : obj.polygons) {
      if (obj.groups[polygon.group] == name) vertices.insert(polygon.vertices.begin(), polygon.vertices.end());
    }
    return {vertices.begin(), vertices.end()};
  }
  Vector3f Delta(size_t shape, int vertex) const {
    Vector3f delta;
    for (int k = 0; k < 3; ++k) {
      uint16_t half = 0;
      const size_t vertices = static_cast<size_t>(obj.vertices.rows());
      std::memcpy(&half, bytes.data() + 2 * ((shape * vertices + vertex) * 3 + k), 2);
      delta[k] = FromHalf(half);
    }
    return delta;
  }
  ObjFile obj;
  std::vector<std::string> names;
  std::string bytes;
};

// Finds points by place.
class Places {
 public:
  explicit Places(const Vertices& positions) : positions_(positions) {
    for (int v = 0; v < positions.rows(); ++v) cells_[Cell(positions.row(v).transpose())].push_back(v);
  }
  // All points within `reach` of the nearest one, which lies within a cell.
  std::vector<int> Near(const Vector3f& p, float reach) const {
    std::vector<std::pair<float, int>> found;
    const auto [x, y, z] = Cell(p);
    for (int i = 0; i < 27; ++i) {
      const auto cell = cells_.find({x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1});
      if (cell == cells_.end()) continue;
      for (const int v : cell->second) found.emplace_back((positions_.row(v).transpose() - p).norm(), v);
    }
    std::sort(found.begin(), found.end());
    std::vector<int> near;
    for (const auto& [distance, v] : found) {
      if (distance <= found[0].first + reach) near.push_back(v);
    }
    return near;
  }

 private:
  static std::array<int, 3> Cell(const Vector3f& p) {
    constexpr float kCell = 0.001f;
    return {static_cast<int>(std::floor(p.x() / kCell)), static_cast<int>(std::floor(p.y() / kCell)),
            static_cast<int>(std::floor(p.z() / kCell))};
  }
  const Vertices& positions_;
  std::map<std::array<int, 3>, std::vector<int>> cells_;
};

class ValidHead : public testing::Test {
 protected:
  void SetUp() override {
    const auto folder = SampleData("heads");
    if (!folder) GTEST_SKIP() << "sample data absent";
    folder_ = *folder;
    SetQuiet(true);
  }
  void TearDown() override { SetQuiet(false); }
  ShapeMap Map() const { return ParseShapeMap("map", ReadFile(folder_ / "arkit_to_valid.json")); }
  fs::path folder_;
};

// Positions within 3 micrometres (the converter's text), displacements within a half float's rounding at 5 cm.
TEST_F(ValidHead, AgreesWithAnIndependentConversion) {
  const GltfScene scene = ReadGltf(folder_ / "White_M_3/White_M_3_Default.glb");
  const Truth truth(folder_ / "White_M_3");
  ASSERT_EQ(truth.names.size(), 77u);
  const auto part_of = [&](const std::string& mesh) -> const GltfPart& {
    return *std::find_if(scene.parts.begin(), scene.parts.end(), [&](const GltfPart& p) { return p.mesh == mesh; });
  };
  Vector3f shift = Vector3f::Constant(-1e9f);
  const GltfPart& eye = part_of("h_L_eye");
  for (int k = 0; k < 3; ++k) {
    float low = 1e9f;
    for (const int v : truth.VerticesOfGroup("L_eye")) low = std::min(low, truth.obj.vertices(v, k));
    shift[k] = eye.positions.col(k).minCoeff() - low;
  }
  for (const auto& [group, mesh] : std::map<std::string, std::string>{{"head", "H_DDS_HighRes"},
                                                                      {"L_eye", "h_L_eye"},
                                                                      {"R_eye", "h_R_eye"},
                                                                      {"TeethUp", "h_TeethUp"},
                                                                      {"TeethDown", "h_TeethDown"},
                                                                      {"R_gland", "h_R_gland"}}) {
    const GltfPart& part = part_of(mesh);
    const Places places(part.positions);
    std::vector<std::vector<Vector3f>> deltas(part.morphs.size());
    for (size_t m = 0; m < part.morphs.size(); ++m) {
      deltas[m].assign(part.positions.rows(), Vector3f::Zero());
      for (size_t i = 0; i < part.morphs[m].vertices.size(); ++i) {
        deltas[m][part.morphs[m].vertices[i]] = part.morphs[m].deltas[i];
      }
    }
    float farthest = 0, worst = 0, largest = 0;
    int compared = 0;
    for (const int v : truth.VerticesOfGroup(group)) {
      const Vector3f p = truth.obj.vertices.row(v).transpose() + shift;
      const std::vector<int> near = places.Near(p, 2e-5f);
      ASSERT_FALSE(near.empty()) << group << " vertex " << v;
      farthest = std::max(farthest, (part.positions.row(near[0]).transpose() - p).norm());
      for (size_t s = 0; s < truth.names.size(); ++s) {
        for (size_t m = 0; m < part.morphs.size(); ++m) {
          if (!part.morphs[m].name.ends_with("." + truth.names[s])) continue;
          const Vector3f expected = truth.Delta(s, v);
          float nearest = 1e9f;
          for (const int u : near) nearest = std::min(nearest, (deltas[m][u] - expected).norm());
          worst = std::max(worst, nearest);
          largest = std::max(largest, expected.norm());
          ++compared;
        }
      }
    }
    EXPECT_LT(farthest, 3e-6f) << group;
    EXPECT_LT(worst, 3e-5f) << group;
    EXPECT_EQ(compared, group == "head" ? 65 * 6997 : group == "TeethDown" ? 12 * 4124 : 0) << group;
    std::printf("%s: positions within %.4f mm, %d displacements up to %.1f mm within %.4f mm\n", group.c_str(),
                1000 * farthest, compared, 1000 * largest, 1000 * worst);
  }
}

// What the tracked mesh of each person must be.
TEST_F(ValidHead, GivesEachPersonAClosedSurfaceAndAnAtlas) {
  std::vector<fs::path> files = {folder_ / "White_M_3/White_M_3_Default.glb"};
  for (const std::string& name : ListFolder(folder_ / "people")) files.push_back(folder_ / "people" / name);
  ASSERT_EQ(files.size(), 8u);
  for (const fs::path& file : files) {
    SCOPED_TRACE(file.string());
    const HeadModel model = BuildHeadModel(file, ReadGltf(file), Map());
    const ClosedSurface surface = CloseSurface(file, model);
    const Vertices rest = surface.Positions(model.shapes.rest(), model.eyes);
    EXPECT_EQ(BorderLoops(surface.triangles).size(), 1u);
    EXPECT_TRUE(surface.lids[kLeft].closed);
    EXPECT_TRUE(surface.lids[kRight].closed);
    EXPECT_GT(surface.vertex_count, 6000);
    EXPECT_LT(surface.vertex_count, 8000);
    for (const ModelEye& eye : model.eyes) {
      EXPECT_TRUE(eye.has_ball);
      EXPECT_NEAR(eye.centre.y(), 0, 1.5f);
      EXPECT_GT(eye.radius, 10);
      EXPECT_LT(eye.radius, 18);
    }

    // Whatever the lids do, the patches lie over the ball, and their ends on the lids.
    for (const char* name : {"jawOpen", "eyeBlinkLeft", "eyeBlinkRight", "eyeWideLeft", "eyeSquintRight"}) {
      std::array<float, kExpressionCount> weights = {};
      weights[ExpressionIndex(name)] = 1;
      const Vertices posed = surface.Positions(model.shapes.Pose(weights), model.eyes);
      for (const int side : {kLeft, kRight}) {
        const LidPatch& lid = surface.lids[side];
        const auto distance = [&](int v) { return (posed.row(v).transpose() - model.eyes[side].centre).norm(); };
        const int end = lid.first + static_cast<int>(lid.top.size()) * (kLidRows - 1);
        for (int v = lid.first; v < end; ++v) {
          EXPECT_GE(distance(v), model.eyes[side].radius + kLidClearanceMm - 0.01f);
          // Not in front of the lids: no farther from the eye than the farther end of its column.
          const size_t column = static_cast<size_t>(v - lid.first) / (kLidRows - 1);
          const float ends = std::max({distance(lid.top[column].a), distance(lid.top[column].b),
                                       distance(lid.bottom[column].a), distance(lid.bottom[column].b)});
          EXPECT_LE(distance(v), std::max(ends, model.eyes[side].radius + kLidClearanceMm) + 0.01f);
        }
      }
    }

    const SurfaceAtlas atlas = MakeSurfaceAtlas(file, surface, rest, model);
    EXPECT_GT(atlas.fill, 0.98f);
    double area = 0;
    for (const Eigen::Vector3i& t : atlas.triangle_uvs) {
      const Eigen::Vector2d a = atlas.uvs[t[0]].cast<double>(), b = atlas.uvs[t[1]].cast<double>() - a,
                            c = atlas.uvs[t[2]].cast<double>() - a;
      const double twice = b.x() * c.y() - b.y() * c.x();
      EXPECT_GT(twice, -1e-9);
      area += twice / 2;
    }
    EXPECT_NEAR(area, atlas.fill, 0.005);  // where triangles overlapped it would be more
    const auto mouth = std::count(surface.regions.begin(), surface.regions.end(), Region::kMouth);
    EXPECT_GT(mouth, 200);
    std::printf("%s: %d vertices, atlas %.1f%% used, eyes %.1f and %.1f mm, mouth of %d triangles\n",
                file.stem().string().c_str(), surface.vertex_count, 100 * atlas.fill, model.eyes[0].radius,
                model.eyes[1].radius, static_cast<int>(mouth));
  }
}

}  // namespace
}  // namespace likeness
