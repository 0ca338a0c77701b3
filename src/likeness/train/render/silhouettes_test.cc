#include "likeness/train/render/silhouettes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "likeness/geometry/proxy_mesh.h"
#include "likeness/train/ops/gradient_check.h"
#include "likeness/train/render/rasterise.h"
#include "likeness/train/render/render_image.h"

namespace likeness {
namespace {

constexpr int kSide = 24;

// From 400 mm, 50 px of focal length: 8 mm a pixel at z = 0.
torch::Tensor FrontalProjection() {
  const Camera camera = LookAt({0, 0, 400}, {0, 0, 0}, {0, 1, 0}, 50, kSide, kSide);
  return Projections({ProjectionOf(camera, {})});
}

torch::Tensor Positions(const Vertices& vertices) {
  return torch::from_blob(const_cast<float*>(vertices.data()), {1, vertices.rows(), 3})
      .to(torch::kFloat64)
      .clone()
      .requires_grad_();
}

torch::Tensor Draw(const torch::Tensor& texture, const torch::Tensor& vertices, const RenderTopology& topology,
                   const torch::Tensor& projection, bool silhouettes) {
  RenderOptions options;
  options.silhouettes = silhouettes;
  return RenderImages(texture, vertices, topology, projection, kSide, kSide, options).colour;
}

// A white board that reaches over two borders of the image: what it covers of each row or column is known exactly, and
// how that changes with its vertices.
TEST(Silhouettes, APixelsColourIsItsShareOfABoard) {
  const torch::Tensor white = torch::ones({1, 3, 2, 2}, torch::kFloat64);
  for (const bool upright : {true, false}) {
    for (const double begin : {-31.0, -30.1, -27.9, -25.2}) {
      const double end = begin + 53.3;
      const ProxyMesh board =
          upright ? BillboardMesh({begin, -900}, {end, 900}, 0) : BillboardMesh({-900, begin}, {900, end}, 0);
      const torch::Tensor vertices = Positions(board.vertices);
      const RenderTopology topology(board.topology, torch::kFloat64);
      const torch::Tensor image = Draw(white, vertices, topology, FrontalProjection(), true);
      const torch::Tensor lines = image[0][0].sum(upright ? 1 : 0);
      for (int64_t i = 0; i < kSide; ++i) EXPECT_NEAR(lines[i].item<double>(), 53.3 / 8, 1e-5);
      EXPECT_LE(image.max().item<double>(), 1);
      EXPECT_GE(image.min().item<double>(), 0);
      // Moving all vertices of one side by 1 mm covers 1 / 8 pixel more in each line.
      image[0][0].sum().backward();
      const torch::Tensor gradient = vertices.grad()[0].select(1, upright ? 0 : 1);
      const torch::Tensor right = vertices.detach()[0].select(1, upright ? 0 : 1) > 0;
      EXPECT_NEAR(gradient.masked_select(right).sum().item<double>(), kSide / 8.0, 1e-5);
      EXPECT_NEAR(gradient.masked_select(right.logical_not()).sum().item<double>(), -kSide / 8.0, 1e-5);
      // Without, lines cover whole pixels, and nothing moves.
      const torch::Tensor hard = Draw(white, vertices, topology, FrontalProjection(), false)[0][0].sum(upright ? 1 : 0);
      for (int64_t i = 0; i < kSide; ++i) EXPECT_EQ(std::fmod(hard[i].item<double>(), 1), 0);
    }
  }
}

// A ball before a board that it partly hides, both with textures.
struct Scene {
  MeshTopology mesh;
  Vertices vertices;
};

Scene BallBeforeBoard() {
  Ellipsoid ball;
  ball.from_ball *= 45;
  const ProxyMesh front = EllipsoidMesh(ball), back = BillboardMesh({-70, -50}, {30, 60}, -120);
  Scene scene;
  scene.mesh = front.topology;
  scene.vertices.resize(front.vertices.rows() + back.vertices.rows(), 3);
  scene.vertices << front.vertices, back.vertices;
  scene.mesh.vertex_count = static_cast<int>(scene.vertices.rows());
  const int corners = static_cast<int>(front.vertices.rows()), uvs = static_cast<int>(front.topology.uvs.size());
  for (const Eigen::Vector3i& t : back.topology.triangles) {
    scene.mesh.triangles.push_back(t + Eigen::Vector3i::Constant(corners));
  }
  for (const Eigen::Vector3i& t : back.topology.triangle_uvs) {
    scene.mesh.triangle_uvs.push_back(t + Eigen::Vector3i::Constant(uvs));
  }
  scene.mesh.uvs.insert(scene.mesh.uvs.end(), back.topology.uvs.begin(), back.topology.uvs.end());
  return scene;
}

TEST(Silhouettes, GradientsEqualFiniteDifferences) {
  const Scene scene = BallBeforeBoard();
  torch::manual_seed(4);
  const torch::Tensor texture = torch::rand({1, 3, 8, 8}, torch::kFloat64).requires_grad_();
  const torch::Tensor target = torch::rand({1, 3, kSide, kSide}, torch::kFloat64);
  const torch::Tensor vertices = Positions(scene.vertices);
  const RenderTopology topology(scene.mesh, torch::kFloat64);
  const torch::Tensor projection = FrontalProjection();
  const torch::Tensor triangle = RasteriseTriangles(vertices, topology, projection, kSide, kSide, {});
  const torch::Tensor inside = Draw(texture, vertices, topology, projection, false).detach();
  const torch::Tensor blended = BlendSilhouettes(inside, triangle, vertices, topology, projection);
  const int64_t changed = ((blended - inside).abs().sum(1) > 1e-9).sum().item<int64_t>();
  EXPECT_GT(changed, 40) << "the ball's outline and the board's";
  EXPECT_LT(changed, 200) << "but not the triangles inside of them";
  CheckGradients(
      {texture, vertices},
      [&] { return (Draw(texture, vertices, topology, projection, true) - target).square().sum(); }, 23);
}

// One colour everywhere: only the outline tells how large a ball is.
TEST(Silhouettes, FindTheSizeOfABall) {
  Ellipsoid unit;
  const ProxyMesh ball = EllipsoidMesh(unit);
  const RenderTopology topology(ball.topology, torch::kFloat64);
  const torch::Tensor grey = torch::full({1, 3, 2, 2}, 0.5, torch::kFloat64);
  const torch::Tensor shape = Positions(ball.vertices).detach(), projection = FrontalProjection();
  const torch::Tensor target = Draw(grey, 60 * shape, topology, projection, true).detach();
  torch::Tensor radius = torch::tensor(45.0, torch::kFloat64).requires_grad_();
  const auto slope = [&](bool silhouettes) {
    radius.mutable_grad().reset();
    (Draw(grey, radius * shape, topology, projection, silhouettes) - target).square().sum().backward();
    return radius.grad().item<double>();
  };
  EXPECT_EQ(slope(false), 0);
  for (int i = 0; i < 60; ++i) {
    const double step = std::clamp(-0.4 * slope(true), -1.0, 1.0) / (1 + 0.1 * i);
    radius = (radius.detach() + step).requires_grad_();
  }
  EXPECT_NEAR(radius.item<double>(), 60, 0.3);
}

}  // namespace
}  // namespace likeness
