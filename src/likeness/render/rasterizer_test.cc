#include "likeness/render/rasterizer.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "likeness/base/parallel.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/geometry/ray_scene.h"

namespace likeness {
namespace {

// A bumpy ball around the origin, radius about 100 mm, with u along the equator and v from pole to pole.
struct Ball {
  Vertices vertices;
  MeshTopology topology;
};

Ball MakeBall(int columns, int rows) {
  Ball ball;
  ball.topology.vertex_count = (columns + 1) * (rows + 1);
  ball.vertices.resize(ball.topology.vertex_count, 3);
  for (int r = 0; r <= rows; ++r) {
    for (int c = 0; c <= columns; ++c) {
      const double turn = 2 * M_PI * c / columns, tilt = M_PI * r / rows;
      const double radius = 100 + 10 * std::sin(5 * turn) * std::sin(4 * tilt);
      ball.vertices.row(r * (columns + 1) + c) << static_cast<float>(radius * std::sin(tilt) * std::sin(turn)),
          static_cast<float>(radius * std::cos(tilt)), static_cast<float>(radius * std::sin(tilt) * std::cos(turn));
      ball.topology.uvs.emplace_back(static_cast<float>(c) / columns, 1 - static_cast<float>(r) / rows);
    }
  }
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int i = r * (columns + 1) + c, below = i + columns + 1;
      ball.topology.triangles.emplace_back(i, below, below + 1);
      ball.topology.triangles.emplace_back(i, below + 1, i + 1);
    }
  }
  ball.topology.triangle_uvs = ball.topology.triangles;
  return ball;
}

// Sees the whole ball at three quarters of the picture's height.
Camera TestCamera(int width, int height) {
  Camera camera = LookAt({150, 120, 500}, {10, -5, 0}, {0.1, 1, 0}, 1.8 * height, width, height);
  camera.intrinsics(0, 1) = 4;  // skew, and a principal point off the centre
  camera.intrinsics(0, 2) += 7;
  camera.intrinsics(1, 1) *= 1.05;
  return camera;
}

RigidTransform TestPose() { return {RotationFromYawPitchRoll(0.4, -0.2, 0.1), Eigen::Vector3d(5, -8, 12)}; }

Vertices InWorld(const Vertices& vertices, const RigidTransform& world_from_mesh) {
  Vertices moved = vertices;
  for (Eigen::Index i = 0; i < moved.rows(); ++i) {
    moved.row(i) = (world_from_mesh * vertices.row(i).transpose().cast<double>()).cast<float>().transpose();
  }
  return moved;
}

Eigen::Vector2f Uv(const MeshTopology& topology, int triangle, float b1, float b2) {
  const Eigen::Vector3i& t = topology.triangle_uvs[triangle];
  return (1 - b1 - b2) * topology.uvs[t[0]] + b1 * topology.uvs[t[1]] + b2 * topology.uvs[t[2]];
}

TEST(RasterizerTest, AgreesWithRays) {
  const Ball ball = MakeBall(40, 24);
  const Camera camera = TestCamera(300, 260);
  const RigidTransform pose = TestPose();
  const FragmentImage image = Rasterize(ball.vertices, ball.topology.triangles, camera, pose);
  RayScene scene;
  scene.Add(InWorld(ball.vertices, pose), ball.topology.triangles, true);
  scene.Build();
  int hits = 0, other_triangle = 0, other_coverage = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      Ray ray;
      ray.origin = camera.CentreInWorld().cast<float>();
      const Eigen::Vector3d direction = camera.RayInWorld({x + 0.5, y + 0.5});
      ray.direction = direction.cast<float>();
      const RayHit hit = scene.Intersect(ray);
      const Fragment& fragment = image.at(x, y);
      other_coverage += (hit.triangle < 0) != (fragment.triangle < 0);
      if (hit.triangle < 0 || fragment.triangle < 0) continue;
      ++hits;
      other_triangle += hit.triangle != fragment.triangle;
      if (hit.triangle != fragment.triangle) continue;
      const Eigen::Vector2f difference = Uv(ball.topology, hit.triangle, hit.b1, hit.b2) -
                                         Uv(ball.topology, fragment.triangle, fragment.b1, fragment.b2);
      EXPECT_LT(difference.norm(), 2e-4) << x << ' ' << y;
      EXPECT_NEAR(fragment.depth_mm, (camera.cam_from_world.rotation * direction).z() * hit.t, 0.01);
    }
  }
  EXPECT_GT(hits, 20000);
  // Only where a pixel centre lies within 1/512 pixel of an edge may the two differ.
  EXPECT_LE(other_coverage, 5);
  EXPECT_LE(other_triangle, hits / 200);
}

TEST(RasterizerTest, SharedEdgesAreCoveredExactlyOnce) {
  // Squares of many sizes and turns, each cut into a fan of triangles around a point inside, plus squares whose edges
  // run exactly through pixel centres.
  Random random(5);
  for (int round = 0; round < 60; ++round) {
    const bool on_centres = round % 3 == 0;
    const double size = on_centres ? 8 : random.Uniform(3, 14), turn = on_centres ? 0 : random.Uniform(0, 7);
    Vertices vertices(5, 3);
    for (int i = 0; i < 4; ++i) {
      const double angle = turn + M_PI / 4 + i * M_PI / 2;
      const double x = 16.5 + std::sqrt(2.0) * size * std::cos(angle),
                   y = 16.5 + std::sqrt(2.0) * size * std::sin(angle);
      vertices.row(i) << static_cast<float>(x), static_cast<float>(y), 100.0f;
    }
    vertices.row(4) << (on_centres ? 16.5f : 15.3f), (on_centres ? 16.5f : 17.9f), 100.0f;
    const std::vector<Eigen::Vector3i> fan = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
    Camera camera;
    camera.width = camera.height = 33;
    camera.intrinsics = Eigen::Vector3d(100, 100, 1).asDiagonal();  // at 100 mm a millimetre is a pixel
    RasterOptions options;
    options.cull_back_faces = false;
    int total = 0;
    std::vector<int> times(33 * 33);
    for (const Eigen::Vector3i& triangle : fan) {
      const FragmentImage image = Rasterize(vertices, {triangle}, camera, {}, options);
      for (size_t i = 0; i < times.size(); ++i) times[i] += image.fragments[i].triangle >= 0;
    }
    const FragmentImage whole = Rasterize(vertices, {{0, 1, 2}, {0, 2, 3}}, camera, {}, options);
    for (size_t i = 0; i < times.size(); ++i) {
      ASSERT_EQ(times[i], whole.fragments[i].triangle >= 0 ? 1 : 0) << "round " << round << " pixel " << i;
      total += times[i];
    }
    // Left and top edges belong to the square, right and bottom ones do not: 16 x 16 centres.
    EXPECT_TRUE(!on_centres || total == 256) << total;
  }
}

TEST(RasterizerTest, BackFacesAreCulled) {
  const Ball ball = MakeBall(20, 12);
  std::vector<Eigen::Vector3i> inside_out = ball.topology.triangles;
  for (Eigen::Vector3i& t : inside_out) std::swap(t[1], t[2]);
  const Camera camera = TestCamera(80, 80);
  const FragmentImage front = Rasterize(ball.vertices, ball.topology.triangles, camera, {});
  const FragmentImage back = Rasterize(ball.vertices, inside_out, camera, {});
  RasterOptions both_sides;
  both_sides.cull_back_faces = false;
  const FragmentImage all = Rasterize(ball.vertices, inside_out, camera, {}, both_sides);
  int farther = 0;
  for (size_t i = 0; i < front.fragments.size(); ++i) {
    EXPECT_EQ(all.fragments[i].triangle, front.fragments[i].triangle);
    EXPECT_EQ(all.fragments[i].depth_mm, front.fragments[i].depth_mm);
    farther += back.fragments[i].triangle >= 0 && back.fragments[i].depth_mm > front.fragments[i].depth_mm + 50;
  }
  EXPECT_GT(farther, 500);
}

TEST(RasterizerTest, TrianglesReachBehindTheCamera) {
  // A floor 50 mm under the camera, from far behind it to far in front of it.
  Vertices floor(4, 3);
  floor << -1e6f, 50, -1e6f, 1e6f, 50, -1e6f, 1e6f, 50, 1e6f, -1e6f, 50, 1e6f;
  Camera camera;
  camera.width = 64, camera.height = 64;
  camera.intrinsics << 60, 0, 32, 0, 60, 32, 0, 0, 1;
  RasterOptions options;
  options.cull_back_faces = false;
  options.near_mm = 100;
  const std::vector<Eigen::Vector3i> triangles = {{0, 1, 2}, {0, 2, 3}};
  const FragmentImage image = Rasterize(floor, triangles, camera, {}, options);
  for (int y = 0; y < 64; ++y) {
    // The floor at depth z appears 60 * 50 / z pixels under the horizon.
    const double depth = y + 0.5 > 32 ? 3000 / (y + 0.5 - 32) : -1;
    for (int x = 0; x < 64; ++x) {
      const Fragment& fragment = image.at(x, y);
      ASSERT_EQ(fragment.triangle >= 0, depth >= 100) << x << ' ' << y;
      if (fragment.triangle < 0) continue;
      EXPECT_NEAR(fragment.depth_mm, depth, 1e-3 * depth);
      const Eigen::Vector3i& t = triangles[fragment.triangle];
      const Eigen::RowVector3f point = (1 - fragment.b1 - fragment.b2) * floor.row(t[0]) +
                                       fragment.b1 * floor.row(t[1]) + fragment.b2 * floor.row(t[2]);
      EXPECT_NEAR(point.x(), (x + 0.5 - 32) / 60 * depth, 1);  // of 2,000,000
    }
  }
  // Wholly behind: nothing.
  Camera away = camera;
  away.cam_from_world.translation = {0, 0, -2e6};
  for (const Fragment& fragment : Rasterize(floor, triangles, away, {}, options).fragments) {
    EXPECT_EQ(fragment.triangle, -1);
  }
}

TEST(RasterizerTest, SurvivesHugeAndBrokenVertices) {
  Random random(9);
  Vertices vertices(300, 3);
  for (auto& x : vertices.reshaped()) {
    x = static_cast<float>(random.Normal() * std::pow(10, random.Uniform(-3, 30)));
  }
  vertices(7, 1) = std::nanf("");
  vertices(9, 0) = std::numeric_limits<float>::infinity();
  std::vector<Eigen::Vector3i> triangles;
  for (int i = 0; i < 298; ++i) triangles.emplace_back(i, i + 1, i + 2);
  triangles.emplace_back(4, 4, 5);
  RasterOptions options;
  options.cull_back_faces = false;
  options.near_mm = 1e-3;
  for (const Fragment& fragment : Rasterize(vertices, triangles, TestCamera(50, 40), {}, options).fragments) {
    if (fragment.triangle < 0) continue;
    EXPECT_GE(fragment.b1, 0);
    EXPECT_GE(fragment.b2, 0);
    EXPECT_LE(fragment.b1 + fragment.b2, 1 + 1e-6f);
  }
}

TEST(RenderTest, TextureLiesTheRightWayUp) {
  // A square that fills the picture, u to the right, v up: rendering gives the texture back.
  Vertices square(4, 3);
  square << 0, 0, 100, 16, 0, 100, 16, 16, 100, 0, 16, 100;  // camera space: y down
  MeshTopology topology;
  topology.vertex_count = 4;
  topology.uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  topology.triangles = {{0, 2, 1}, {0, 3, 2}};
  topology.triangle_uvs = topology.triangles;
  ImageF texture(16, 16, 3);
  Random random(2);
  for (float& value : texture.values()) value = static_cast<float>(random.Below(256));
  Camera camera;
  camera.width = camera.height = 16;
  camera.intrinsics = Eigen::Vector3d(100, 100, 1).asDiagonal();
  DrawOptions options;
  options.supersample = 1;
  const Rendering rendering = DrawMesh(square, topology, texture, camera, {}, options);
  for (size_t i = 0; i < texture.values().size(); ++i) {
    EXPECT_NEAR(rendering.colour.values()[i], texture.values()[i], 0.51);
  }
  for (const uint8_t coverage : rendering.coverage.values()) EXPECT_EQ(coverage, 255);
}

TEST(RenderTest, SamplesBetweenTexels) {
  ImageF texture(2, 2, 3);
  for (int c = 0; c < 3; ++c)
    texture.at(0, 0)[c] = 10, texture.at(1, 0)[c] = 20, texture.at(0, 1)[c] = 50, texture.at(1, 1)[c] = 80;
  EXPECT_FLOAT_EQ(SampleTexture(texture, {0.25f, 0.75f})[0], 10);
  EXPECT_FLOAT_EQ(SampleTexture(texture, {0.5f, 0.75f})[1], 15);
  EXPECT_FLOAT_EQ(SampleTexture(texture, {0.5f, 0.5f})[2], 40);
  EXPECT_FLOAT_EQ(SampleTexture(texture, {0, 0})[0], 50);
  EXPECT_FLOAT_EQ(SampleTexture(texture, {9, -9})[0], 80);
}

TEST(RenderTest, SupersamplingIsTheMeanOfTheFinePicture) {
  const Ball ball = MakeBall(20, 12);
  ImageF texture(32, 32, 3);
  Random random(4);
  for (float& value : texture.values()) value = static_cast<float>(random.Uniform(0, 255));
  const Camera camera = TestCamera(90, 70);
  DrawOptions fine, coarse;
  fine.supersample = 1;
  coarse.supersample = 3;
  fine.background = coarse.background = {9, 99, 199};
  coarse.linear_edges = false;
  const Rendering small = DrawMesh(ball.vertices, ball.topology, texture, camera, TestPose(), coarse);
  const Rendering large = DrawMesh(ball.vertices, ball.topology, texture, camera.Resized(270, 210), TestPose(), fine);
  for (int y = 0; y < 70; ++y) {
    for (int x = 0; x < 90; ++x) {
      double colour = 0, coverage = 0;
      for (int s = 0; s < 9; ++s) {
        const int column = 3 * x + s / 3, row = 3 * y + s % 3;
        colour += large.colour.at(column, row)[1] / 9.0;
        coverage += *large.coverage.at(column, row) / 9.0;
      }
      ASSERT_NEAR(small.colour.at(x, y)[1], colour, 1.01);
      ASSERT_NEAR(*small.coverage.at(x, y), coverage, 0.51);
    }
  }
  EXPECT_EQ(small.colour.at(0, 0)[2], 199);
}

TEST(RenderTest, EdgesMixLight) {
  // A triangle over the left half of a 2 x 2 picture's pixels at 4 x 4 samples: half of the first column's samples.
  Vertices vertices(3, 3);
  vertices << 0.5f, -50, 100, 0.5f, 50, 100, -99.5f, 0, 100;
  MeshTopology topology;
  topology.vertex_count = 3;
  topology.uvs = {{0, 0}, {1, 0}, {0, 1}};
  topology.triangles = topology.triangle_uvs = {{0, 1, 2}};
  Camera camera;
  camera.width = camera.height = 2;
  camera.intrinsics = Eigen::Vector3d(100, 100, 1).asDiagonal();
  DrawOptions options;
  options.raster.cull_back_faces = false;
  options.supersample = 4;
  options.background = {0, 64, 200};
  const ImageF texture(2, 2, 3, 200);
  const Rendering light = DrawMesh(vertices, topology, texture, camera, {}, options);
  ASSERT_EQ(*light.coverage.at(0, 0), 128);
  EXPECT_EQ(light.colour.at(0, 0)[0], 146);  // half of the light of 200: 0.5776 / 2 = 0.2888, encoded 0.5738
  EXPECT_EQ(light.colour.at(0, 0)[1], 152);  // and of 64: (0.5776 + 0.0513) / 2 = 0.3144, encoded 0.5964
  EXPECT_EQ(light.colour.at(0, 0)[2], 200);
  EXPECT_EQ(light.colour.at(1, 0)[1], 64);
  options.linear_edges = false;
  EXPECT_EQ(DrawMesh(vertices, topology, texture, camera, {}, options).colour.at(0, 0)[1], 132);
}

TEST(RenderTest, IsTheSameForAnyNumberOfThreads) {
  const Ball ball = MakeBall(30, 20);
  ImageF texture(16, 16, 3);
  for (size_t i = 0; i < texture.values().size(); ++i) texture.values()[i] = static_cast<float>(i % 256);
  SetThreadCount(1);
  const Rendering one = DrawMesh(ball.vertices, ball.topology, texture, TestCamera(200, 150), TestPose());
  SetThreadCount(3);
  const Rendering three = DrawMesh(ball.vertices, ball.topology, texture, TestCamera(200, 150), TestPose());
  SetThreadCount(0);
  EXPECT_EQ(one.colour, three.colour);
  EXPECT_EQ(one.coverage, three.coverage);
}

TEST(RenderTest, OptionsAreChecked) {
  DrawOptions options;
  options.supersample = 0;
  EXPECT_NE(ErrorOf([&] { options.Check(); }).find("supersample"), std::string::npos);
  options = {};
  options.background[1] = 256;
  EXPECT_NE(ErrorOf([&] { options.Check(); }).find("background"), std::string::npos);
  options = {};
  options.raster.near_mm = 0;
  EXPECT_NE(ErrorOf([&] { options.Check(); }).find("near plane"), std::string::npos);
}

}  // namespace
}  // namespace likeness
