// The rendering layer against plain references and finite differences, on random scenes.

#include "likeness/train/render/render_image.h"

#include <gtest/gtest.h>

#include <cmath>

#include "likeness/base/random.h"
#include "likeness/geometry/proxy_mesh.h"
#include "likeness/train/ops/gradient_check.h"
#include "likeness/train/render/interpolate.h"
#include "likeness/train/render/rasterise.h"
#include "likeness/train/render/sample.h"
#include "likeness/train/render/shade.h"

namespace likeness {
namespace {

constexpr int kHeight = 20, kWidth = 24, kSide = 12;

// Some meshes, cameras and textures; what a test is about is in the mesh.
struct Scene {
  Vertices vertices;
  MeshTopology mesh;
  std::vector<Camera> cameras;
  RasterOptions raster;
};

Camera At(const Eigen::Vector3d& centre, double focal_px) {
  Camera camera = LookAt(centre, {0, 0, 0}, {0.1, 1, 0}, focal_px, kWidth, kHeight);
  camera.intrinsics(0, 1) = 0.5;
  camera.intrinsics(1, 1) *= 1.1;
  return camera;
}

// Loose triangles of a few pixels each, every corner with texture coordinates of its own, some outside of [0, 1].
//   thin  their width in parts of their length
Scene LooseTriangles(uint64_t seed, int count, double size_mm, double thin = 1) {
  Random random(seed);
  Scene scene;
  scene.vertices.resize(3 * count, 3);
  for (int t = 0; t < count; ++t) {
    const Eigen::Vector3d centre(random.Uniform(-60, 60), random.Uniform(-50, 50), random.Uniform(-60, 60));
    const Eigen::Vector3d along(random.Normal(), random.Normal(), random.Normal());
    for (int c = 0; c < 3; ++c) {
      const double way = random.Normal();
      for (int axis = 0; axis < 3; ++axis) {
        const double offset = thin * random.Normal() + (1 - thin) * way * along[axis];
        scene.vertices(3 * t + c, axis) = static_cast<float>(centre[axis] + size_mm * offset);
      }
      scene.mesh.uvs.emplace_back(static_cast<float>(random.Uniform(-0.2, 1.2)),
                                  static_cast<float>(random.Uniform(-0.2, 1.2)));
    }
    scene.mesh.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
  }
  scene.mesh.triangle_uvs = scene.mesh.triangles;
  scene.mesh.vertex_count = 3 * count;
  scene.cameras = {At({100, 50, 400}, 60), At({-150, 80, 350}, 50)};
  scene.raster.cull_back_faces = false;
  return scene;
}

// A closed surface whose texture is cut at the back, where the camera looks: its seam vertices have two coordinates.
Scene Seam() {
  Scene scene;
  Ellipsoid ball;
  ball.from_ball *= 70;
  const ProxyMesh mesh = EllipsoidMesh(ball);
  scene.vertices = mesh.vertices;
  scene.mesh = mesh.topology;
  scene.cameras = {At({30, 20, -400}, 50), At({0, 300, -250}, 50)};
  return scene;
}

// A floor from behind the camera to far in front of it.
Scene BehindTheCamera() {
  Scene scene;
  scene.vertices.resize(4, 3);
  scene.vertices << -300, -60, 900, 300, -60, 900, 300, -70, -900, -300, -75, -900;
  scene.mesh.vertex_count = 4;
  scene.mesh.uvs = {{0, 0}, {1, 0.1f}, {0.9f, 1}, {0.1f, 1}};
  scene.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.mesh.triangle_uvs = scene.mesh.triangles;
  scene.cameras = {At({0, 0, 300}, 20), At({20, 10, 200}, 15)};
  scene.raster.cull_back_faces = false;
  return scene;
}

struct Tensors {
  RenderTopology topology;
  torch::Tensor texture, vertices, projections, triangle, target;
};

Tensors Build(const Scene& scene, torch::ScalarType type, int side = kSide) {
  Tensors t;
  torch::manual_seed(6);
  const auto count = static_cast<int64_t>(scene.cameras.size());
  t.topology = RenderTopology(scene.mesh, torch::TensorOptions(type));
  t.texture = torch::rand({count, 3, side, side}, torch::kFloat64).to(type);
  const torch::Tensor once =
      torch::from_blob(const_cast<float*>(scene.vertices.data()), {scene.vertices.rows(), 3}).clone().to(type);
  t.vertices = once.unsqueeze(0).repeat({count, 1, 1});
  std::vector<PixelFromMesh> projections;
  const RigidTransform pose = {RotationFromYawPitchRoll(0.1, -0.05, 0.02), {3, -2, 1}};
  for (const Camera& camera : scene.cameras) projections.push_back(ProjectionOf(camera, pose));
  t.projections = Projections(projections);
  t.triangle = RasteriseTriangles(t.vertices, t.topology, t.projections, kHeight, kWidth, scene.raster);
  t.target = torch::rand({count, 3, kHeight, kWidth}, torch::kFloat64).to(type);
  for (torch::Tensor* leaf : {&t.texture, &t.vertices, &t.topology.uvs}) leaf->requires_grad_();
  return t;
}

std::vector<torch::Tensor> Leaves(const Tensors& t) { return {t.texture, t.vertices, t.topology.uvs}; }

std::vector<std::pair<const char*, Scene>> Scenes() {
  return {{"loose triangles", LooseTriangles(3, 60, 15)},
          {"triangles of less than a pixel", LooseTriangles(4, 3000, 1.5)},
          {"slivers", LooseTriangles(5, 3000, 15, 0.003)},
          {"seam", Seam()},
          {"behind the camera", BehindTheCamera()}};
}

int64_t Covered(const Tensors& t) { return (t.triangle >= 0).sum().item<int64_t>(); }

TEST(RenderImage, GradientsEqualFiniteDifferences) {
  for (const auto& [name, scene] : Scenes()) {
    SCOPED_TRACE(name);
    for (const bool fused : {true, false}) {
      const Tensors t = Build(scene, torch::kFloat64);
      ASSERT_GT(Covered(t), 15);
      const auto loss = [&] {
        const torch::Tensor image = fused ? ShadeFused(t.triangle, t.texture, t.vertices, t.topology, t.projections)
                                          : ShadePlain(t.triangle, t.texture, t.vertices, t.topology, t.projections);
        return (image - t.target).square().sum();
      };
      // A scene of thousands of vertices has few that any pixel shows: look at those.
      CheckGradients(Leaves(t), loss, std::max<int64_t>(1, t.vertices.numel() / 400));
      EXPECT_GT(t.vertices.grad().abs().max().item<double>(), 1e-4);
    }
  }
}

TEST(RenderImage, FusedEqualsPlainOperationsInDoublePrecision) {
  for (const auto& [name, scene] : Scenes()) {
    SCOPED_TRACE(name);
    const Tensors a = Build(scene, torch::kFloat64), b = Build(scene, torch::kFloat64);
    const torch::Tensor fused = ShadeFused(a.triangle, a.texture, a.vertices, a.topology, a.projections);
    const torch::Tensor plain = ShadePlain(b.triangle, b.texture, b.vertices, b.topology, b.projections);
    EXPECT_LT((fused - plain).abs().max().item<double>(), 1e-9);
    (fused - a.target).square().sum().backward();
    (plain - b.target).square().sum().backward();
    for (size_t i = 0; i < Leaves(a).size(); ++i) {
      const torch::Tensor expected = Leaves(b)[i].grad(), difference = Leaves(a)[i].grad() - expected;
      EXPECT_LT(difference.abs().max().item<double>(), 1e-8 * (1 + expected.abs().max().item<double>())) << i;
    }
  }
}

TEST(RenderImage, Float32StaysNearFloat64) {
  for (const auto& [name, scene] : Scenes()) {
    SCOPED_TRACE(name);
    if (std::string(name) == "slivers") continue;  // whose weights hang on the last digits of their vertices
    const Tensors a = Build(scene, torch::kFloat32), b = Build(scene, torch::kFloat64);
    const torch::Tensor single = ShadeFused(a.triangle, a.texture, a.vertices, a.topology, a.projections);
    const torch::Tensor twice = ShadeFused(b.triangle, b.texture, b.vertices, b.topology, b.projections);
    // Texture coordinates carry some roundings of 6e-8; across the texture colours change by kSide a unit.
    EXPECT_LT((single - twice).abs().max().item<double>(), 2e-5);
    (single - a.target).square().sum().backward();
    (twice - b.target).square().sum().backward();
    for (size_t i = 0; i < Leaves(a).size(); ++i) {
      const torch::Tensor expected = Leaves(b)[i].grad(), difference = Leaves(a)[i].grad() - expected;
      EXPECT_LT(difference.norm().item<double>(), 2e-4 * expected.norm().item<double>()) << i;
    }
  }
}

TEST(RenderImage, DrawsWhatTheRendererDraws) {
  // render/rasterizer.h draws the same ball from its own barycentric weights.
  const Scene scene = Seam();
  Tensors t = Build(scene, torch::kFloat32);
  const torch::NoGradGuard no_grad;
  t.texture.mul_(255);
  const torch::Tensor images = ShadeFused(t.triangle, t.texture, t.vertices, t.topology, t.projections);
  const torch::Tensor rows = t.texture[1].permute({1, 2, 0}).contiguous();
  ImageF texture(kSide, kSide, 3);
  std::copy_n(rows.const_data_ptr<float>(), rows.numel(), texture.values().data());
  DrawOptions draw;
  draw.supersample = 1;
  const RigidTransform pose = {RotationFromYawPitchRoll(0.1, -0.05, 0.02), {3, -2, 1}};
  const Rendering truth = DrawMesh(scene.vertices, scene.mesh, texture, scene.cameras[1], pose, draw);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < 3; ++c) {
        // It rounds to integers, and pulls centres beside a triangle by 1/512 pixel back onto it another way.
        EXPECT_NEAR(images[1][c][y][x].item<float>(), truth.colour.at(x, y)[c], 0.7);
      }
    }
  }
}

TEST(RasteriseTriangles, CropsAreCutFromTheWholeImage) {
  const Scene scene = Seam();
  const Tensors t = Build(scene, torch::kFloat32);
  const Camera& camera = scene.cameras[0];
  const RigidTransform pose = {RotationFromYawPitchRoll(0.1, -0.05, 0.02), {3, -2, 1}};
  const torch::Tensor crop = RasteriseTriangles(t.vertices.narrow(0, 0, 1), t.topology,
                                                Projections({ProjectionOf(camera, pose, 7, 5)}), 9, 11, scene.raster);
  EXPECT_TRUE(crop[0].equal(t.triangle[0].narrow(0, 5, 9).narrow(1, 7, 11)));
  EXPECT_GT((crop >= 0).sum().item<int64_t>(), 30);
  // Beyond the image's border as well: what is there is drawn.
  const torch::Tensor outside = RasteriseTriangles(
      t.vertices.narrow(0, 0, 1), t.topology, Projections({ProjectionOf(camera, pose, 12, -3)}), 9, 20, scene.raster);
  EXPECT_TRUE(outside[0].narrow(0, 3, 6).narrow(1, 0, 12).equal(t.triangle[0].narrow(0, 0, 6).narrow(1, 12, 12)));
}

TEST(RasteriseTriangles, BackFacesAreAnOption) {
  Scene scene = LooseTriangles(3, 60, 15);
  const int64_t both = Covered(Build(scene, torch::kFloat32));
  scene.raster.cull_back_faces = true;
  const int64_t front = Covered(Build(scene, torch::kFloat32));
  EXPECT_LT(front, both);
  EXPECT_GT(front, both / 4);
}

// What SampleTextures should give, a pixel and a channel at a time.
double Sample(const torch::Tensor& texture, int64_t n, int64_t c, double u, double v) {
  const auto height = texture.size(2), width = texture.size(3);
  const auto at = [&](double x, double y) {
    const auto column = static_cast<int64_t>(std::clamp(x, 0.0, static_cast<double>(width - 1)));
    const auto row = static_cast<int64_t>(std::clamp(y, 0.0, static_cast<double>(height - 1)));
    return texture[n][c][row][column].item<double>();
  };
  const double x = u * static_cast<double>(width) - 0.5, y = (1 - v) * static_cast<double>(height) - 0.5;
  const double x0 = std::floor(x), y0 = std::floor(y), fx = x - x0, fy = y - y0;
  return (1 - fy) * ((1 - fx) * at(x0, y0) + fx * at(x0 + 1, y0)) +
         fy * ((1 - fx) * at(x0, y0 + 1) + fx * at(x0 + 1, y0 + 1));
}

TEST(SampleTextures, EqualsThePlainReference) {
  torch::manual_seed(2);
  const torch::Tensor texture = torch::rand({2, 3, 5, 7}, torch::kFloat64);
  const torch::Tensor uv = torch::rand({2, 6, 4, 2}, torch::kFloat64) * 1.6 - 0.3;
  const torch::Tensor colour = SampleTextures(texture, uv);
  for (int64_t i = 0; i < colour.numel(); ++i) {
    const int64_t n = i / 72, c = i / 24 % 3, y = i / 4 % 6, x = i % 4;
    const double expected = Sample(texture, n, c, uv[n][y][x][0].item<double>(), uv[n][y][x][1].item<double>());
    EXPECT_NEAR(colour[n][c][y][x].item<double>(), expected, 1e-12);
  }
}

TEST(SampleTextures, ATextureOfOneTexelIsItsColour) {
  const Tensors t = Build(LooseTriangles(3, 60, 15), torch::kFloat64, 1);
  const torch::Tensor image = ShadeFused(t.triangle, t.texture, t.vertices, t.topology, t.projections);
  const torch::Tensor mask = (t.triangle >= 0).unsqueeze(1).to(torch::kFloat64);
  EXPECT_TRUE(image.equal((mask * t.texture).contiguous()));
  image.sum().backward();
  EXPECT_NEAR(t.texture.grad().sum().item<double>(), 3.0 * static_cast<double>(Covered(t)), 1e-9);
  EXPECT_EQ(t.vertices.grad().abs().max().item<double>(), 0);
}

TEST(SampleMipMaps, LevelsAreMeansOfTexelsAndMixLinearly) {
  torch::manual_seed(2);
  const torch::Tensor texture = torch::rand({1, 3, 8, 8}, torch::kFloat64).requires_grad_();
  const torch::Tensor uv = torch::rand({1, 3, 3, 2}, torch::kFloat64).requires_grad_();
  const auto at = [&](double level) {
    return SampleMipMaps(texture, uv, torch::full({1, 3, 3}, level, torch::kFloat64));
  };
  const auto equal = [](const torch::Tensor& a, const torch::Tensor& b) {
    return (a - b).abs().max().item<double>() < 1e-12;
  };
  EXPECT_TRUE(equal(at(0), SampleTextures(texture, uv)));
  EXPECT_TRUE(equal(at(-2), at(0)));
  EXPECT_TRUE(equal(at(1.25), 0.75 * at(1) + 0.25 * at(2)));
  EXPECT_TRUE(equal(at(9), texture.mean({2, 3}, true).expand({1, 3, 3, 3})));
  CheckGradients({texture, uv}, [&] { return at(0.6).square().sum(); });
}

TEST(RenderImages, MipMapsFollowTheSizeOfTexels) {
  // A chequerboard of single texels, so far away that a pixel covers many of them: grey.
  Scene scene;
  const ProxyMesh board = BillboardMesh({-50, -50}, {50, 50}, 0);
  scene.vertices = board.vertices;
  scene.mesh = board.topology;
  scene.cameras = {LookAt({0, 0, 400}, {0, 0, 0}, {0, 1, 0}, 60, kWidth, kHeight)};
  Tensors t = Build(scene, torch::kFloat32, 128);
  const torch::NoGradGuard no_grad;
  const torch::Tensor steps = torch::arange(128);
  t.texture.copy_(((steps.unsqueeze(0) + steps.unsqueeze(1)) % 2).to(torch::kFloat32));
  RenderOptions options;
  options.mip_maps = true;
  const RenderedImages images =
      RenderImages(t.texture, t.vertices, t.topology, t.projections, kHeight, kWidth, options);
  const torch::Tensor seen = images.colour.masked_select((images.triangle >= 0).unsqueeze(1));
  EXPECT_GT(seen.numel(), 300);
  EXPECT_LT((seen - 0.5).abs().max().item<float>(), 1e-3);
}

}  // namespace
}  // namespace likeness
