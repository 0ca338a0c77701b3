// The frame renderer against the plain one: the same coverage exactly, colours by a plain trilinear sampler in double.

#include "likeness/render/frame_renderer.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/render/raster_kernels.h"
#include "likeness/render/rasterizer.h"
#include "likeness/simulate/procedural_head.h"

namespace likeness {
namespace {

struct Scene {
  Vertices vertices;
  MeshTopology topology;
  PixelFromMesh projection;
  int width = 0, height = 0;
};

// Triangles of all sizes: some reach behind the camera, some are slivers, some far outside of the picture.
Scene RandomScene(uint64_t seed) {
  constexpr int kTriangles = 400;
  Random random(seed);
  Scene scene;
  scene.width = 150 + static_cast<int>(random.Below(100));
  scene.height = 90 + static_cast<int>(random.Below(60));
  Camera camera;
  camera.intrinsics << 120, 3, 90, 0, 125, 60, 0, 0, 1;
  scene.projection = ProjectionOf(camera, {});
  scene.topology.vertex_count = 3 * kTriangles;
  scene.vertices.resize(scene.topology.vertex_count, 3);
  for (int t = 0; t < kTriangles; ++t) {
    const double size = std::pow(10, random.Uniform(-0.5, 3));
    const Eigen::Vector3d middle(random.Normal() * 200, random.Normal() * 150, random.Uniform(-100, 600));
    const Eigen::Vector3d along = size * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
    const double thickness = t % 4 == 0 ? 1e-3 : 1;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d apart = size * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
      scene.vertices.row(3 * t + k) = (middle + k * along + thickness * apart).cast<float>().transpose();
    }
    scene.topology.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
  }
  return scene;
}

Scene HeadScene(int width, int height) {
  const auto head = MakeProceduralHead();
  std::array<float, kExpressionCount> weights = {};
  weights[ExpressionIndex("jawOpen")] = 0.7f;
  Scene scene;
  scene.vertices = head->Pose(weights).tracked;
  scene.topology = head->tracked_topology();
  scene.width = width, scene.height = height;
  scene.projection = ProjectionOf(LookAt({350, 60, 900}, {0, 0, 0}, {0, 1, 0}, 2.2 * height, width, height), {});
  return scene;
}

std::vector<uint8_t> NoiseTexture(int size, uint64_t seed) {
  Random random(seed);
  std::vector<uint8_t> texture(size_t{4} * size * size, 255);
  for (size_t i = 0; i < texture.size(); ++i) {
    if (i % 4 != 3) texture[i] = static_cast<uint8_t>(random.Below(256));
  }
  return texture;
}

// Each triangle looks at one texel of 32 x 32, which differ.
std::vector<uint8_t> NumberTriangles(Scene* scene) {
  std::vector<uint8_t> texture(4 * 32 * 32, 255);
  for (int i = 0; i < 1024; ++i)
    texture[4 * i] = static_cast<uint8_t>(i % 256), texture[4 * i + 1] = static_cast<uint8_t>(i / 256);
  scene->topology.uvs.clear();
  scene->topology.triangle_uvs.clear();
  for (int i = 0; i < static_cast<int>(scene->topology.triangles.size()); ++i) {
    const int texel = i % 1024;
    scene->topology.uvs.emplace_back((static_cast<float>(texel % 32) + 0.5f) / 32,
                                     1 - (static_cast<float>(texel / 32) + 0.5f) / 32);
    scene->topology.triangle_uvs.emplace_back(i, i, i);
  }
  return texture;
}

ImageU8 Drawn(FrameRenderer& renderer, const Scene& scene, const std::vector<uint8_t>& texture) {
  ImageU8 picture(scene.width, scene.height, 4, 77);
  const FrameRenderer::View view = {scene.projection, scene.width,    scene.height,
                                    texture.data(),   picture.row(0), int64_t{4} * scene.width};
  renderer.Draw({scene.vertices.data(), static_cast<size_t>(scene.vertices.size())}, {&view, 1});
  return picture;
}

int SizeOf(const std::vector<uint8_t>& texture) { return static_cast<int>(std::lround(std::sqrt(texture.size() / 4))); }

ImageU8 Draw(const Scene& scene, const std::vector<uint8_t>& texture, const FrameRendererOptions& options) {
  FrameRenderer renderer(scene.topology, SizeOf(texture), options);
  return Drawn(renderer, scene, texture);
}

FrameRendererOptions With(const RasterKernel* kernel) {
  FrameRendererOptions options;
  options.kernel = kernel->name;
  options.transparent = true;
  return options;
}

// Coverage, and of which triangle, pixel by pixel.
void ExpectSameTriangles(Scene scene, bool cull) {
  const std::vector<uint8_t> texture = NumberTriangles(&scene);
  RasterOptions plain;
  plain.cull_back_faces = cull;
  const FragmentImage truth =
      Rasterize(scene.vertices, scene.topology.triangles, scene.projection, scene.width, scene.height, plain);
  for (const RasterKernel* kernel : AvailableRasterKernels()) {
    SCOPED_TRACE(kernel->name);
    FrameRendererOptions options = With(kernel);
    options.cull_back_faces = cull;
    const ImageU8 picture = Draw(scene, texture, options);
    int covered = 0, other_coverage = 0, other_triangle = 0;
    for (int y = 0; y < scene.height; ++y) {
      for (int x = 0; x < scene.width; ++x) {
        const int triangle = truth.at(x, y).triangle;
        const uint8_t* const pixel = picture.at(x, y);
        covered += triangle >= 0;
        other_coverage += pixel[3] != (triangle >= 0 ? 255 : 0);
        other_triangle += triangle >= 0 && pixel[0] + 256 * pixel[1] != triangle % 1024;
      }
    }
    EXPECT_GT(covered, scene.width * scene.height / 10);
    EXPECT_EQ(other_coverage, 0);
    // Where surfaces cross, depths may be equal in float32.
    EXPECT_LE(other_triangle, covered / 2000);
  }
}

TEST(FrameRendererTest, CoversWhatThePlainRendererCovers) {
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    ExpectSameTriangles(RandomScene(seed), seed % 2 == 0);
  }
  ExpectSameTriangles(HeadScene(300, 260), true);
}

// Levels of a texture and what is seen through a pixel, in double.
class PlainSampler {
 public:
  explicit PlainSampler(const std::vector<uint8_t>& texture) : levels_{texture} {
    for (int size = SizeOf(texture) / 2; size >= 2; size /= 2) {
      const std::vector<uint8_t>& fine = levels_.back();
      std::vector<uint8_t> coarse(size_t{4} * size * size);
      for (int i = 0; i < 4 * size * size; ++i) {
        const int x = i / 4 % size, y = i / 4 / size, at = (2 * y * 2 * size + 2 * x) * 4 + i % 4;
        coarse[i] =
            static_cast<uint8_t>((fine[at] + fine[at + 4] + fine[at + 8 * size] + fine[at + 8 * size + 4] + 2) / 4);
      }
      levels_.push_back(coarse);
    }
  }

  // Texels of the finest level; `footprint` how many of them a pixel is long.
  double Colour(const Eigen::Vector2d& texel, double footprint, int channel) const {
    const double detail = std::clamp(std::log2(footprint), 0.0, static_cast<double>(levels_.size() - 1));
    const auto level = std::min(static_cast<size_t>(detail), levels_.size() - 2);
    const double share = detail - static_cast<double>(level);
    return (1 - share) * Bilinear(level, texel, channel) + share * Bilinear(level + 1, texel, channel);
  }

 private:
  double Bilinear(size_t level, const Eigen::Vector2d& texel, int channel) const {
    const std::vector<uint8_t>& texels = levels_[level];
    const int size = SizeOf(texels);
    const Eigen::Vector2d at = (texel / std::pow(2, level) - Eigen::Vector2d(0.5, 0.5)).cwiseMax(0).cwiseMin(size - 1);
    const int x = std::min(static_cast<int>(at.x()), size - 2), y = std::min(static_cast<int>(at.y()), size - 2);
    const auto value = [&](int i, int j) { return texels[4 * (j * size + i) + channel]; };
    const double fx = at.x() - x, fy = at.y() - y;
    return (1 - fy) * ((1 - fx) * value(x, y) + fx * value(x + 1, y)) +
           fy * ((1 - fx) * value(x, y + 1) + fx * value(x + 1, y + 1));
  }

  std::vector<std::vector<uint8_t>> levels_;
};

// Where the plane of a triangle is hit through a place of the picture, in texels; not clamped.
Eigen::Vector2d TexelAt(const Scene& scene, int triangle, int size, double x, double y) {
  Eigen::Matrix3d corners;
  Eigen::Matrix<double, 2, 3> texels;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d vertex = scene.vertices.row(scene.topology.triangles[triangle][k]).transpose().cast<double>();
    corners.col(k) = scene.projection * vertex.homogeneous();
    const Eigen::Vector2f& uv = scene.topology.uvs[scene.topology.triangle_uvs[triangle][k]];
    texels.col(k) << uv.x() * size, (1.0 - uv.y()) * size;
  }
  const Eigen::Vector3d weights = corners.inverse() * Eigen::Vector3d(x, y, 1);
  return texels * weights / weights.sum();
}

TEST(FrameRendererTest, ColoursAreTrilinear) {
  constexpr int kSize = 256;
  const std::vector<uint8_t> texture = NoiseTexture(kSize, 3);
  const PlainSampler sampler(texture);
  for (const int height : {60, 160, 700}) {  // the texture is far too fine, about right, too coarse
    SCOPED_TRACE(height);
    const Scene scene = HeadScene(height, height);
    const FragmentImage truth =
        Rasterize(scene.vertices, scene.topology.triangles, scene.projection, scene.width, scene.height);
    for (const RasterKernel* kernel : AvailableRasterKernels()) {
      SCOPED_TRACE(kernel->name);
      const ImageU8 picture = Draw(scene, texture, With(kernel));
      int covered = 0, off = 0;
      double largest = 0;
      for (int y = 0; y < scene.height; ++y) {
        for (int x = 0; x < scene.width; ++x) {
          const Fragment& fragment = truth.at(x, y);
          if (fragment.triangle < 0) continue;
          constexpr double kStep = 1e-4;
          const auto at = [&](double dx, double dy) {
            return TexelAt(scene, fragment.triangle, kSize, x + 0.5 + dx, y + 0.5 + dy);
          };
          const Eigen::Vector2d along_x = (at(kStep, 0) - at(-kStep, 0)) / (2 * kStep),
                                along_y = (at(0, kStep) - at(0, -kStep)) / (2 * kStep);
          const double colour = sampler.Colour(at(0, 0), std::max(along_x.norm(), along_y.norm()), 1);
          const double difference = std::abs(picture.at(x, y)[1] - colour);
          largest = std::max(largest, difference);
          ++covered;
          off += difference > 2;
        }
      }
      // Half from rounding, 1.3 from the logarithm. A pixel whose centre is off its triangle looks along the rim.
      EXPECT_LE(off, covered / 1000) << "largest " << largest;
      EXPECT_GT(covered, height * height / 10);
    }
  }
}

TEST(FrameRendererTest, CropsAndPairsAreLikeWholePictures) {
  const Scene scene = HeadScene(300, 260);
  const std::vector<uint8_t> texture = NoiseTexture(128, 4), other = NoiseTexture(128, 5);
  const ImageU8 whole = Draw(scene, texture, {});
  FrameRendererOptions options;
  options.threads = 3;
  FrameRenderer renderer(scene.topology, 128, options);
  ImageU8 crop(90, 70, 4), second(scene.width, scene.height, 4);
  Eigen::Matrix3d moved = Eigen::Matrix3d::Identity();
  moved(0, 2) = -130, moved(1, 2) = -60;
  const FrameRenderer::View views[2] = {
      {moved * scene.projection, 90, 70, texture.data(), crop.row(0), 4 * 90},
      {scene.projection, scene.width, scene.height, other.data(), second.row(0), int64_t{4} * scene.width}};
  renderer.Draw({scene.vertices.data(), static_cast<size_t>(scene.vertices.size())}, views);
  for (int y = 0; y < 70; ++y) {
    for (int x = 0; x < 90; ++x) {
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(crop.at(x, y)[c], whole.at(x + 130, y + 60)[c], 1) << x << ' ' << y;
    }
  }
  EXPECT_EQ(second, Draw(scene, other, {}));
}

TEST(FrameRendererTest, IsTheSameForAnyNumberOfThreadsAndFrameAfterFrame) {
  const Scene scene = HeadScene(300, 260);
  const std::vector<uint8_t> texture = NoiseTexture(128, 6);
  for (const bool anti_alias : {false, true}) {
    FrameRendererOptions options;
    options.anti_alias = anti_alias;
    options.threads = 1;
    const ImageU8 one = Draw(scene, texture, options);
    for (const int threads : {2, 5}) {
      options.threads = threads;
      FrameRenderer renderer(scene.topology, 128, options);
      for (int frame = 0; frame < 3; ++frame) ASSERT_EQ(Drawn(renderer, scene, texture), one) << threads;
    }
  }
}

TEST(FrameRendererTest, NothingInSightLeavesTheBackground) {
  Scene scene = HeadScene(200, 130);
  const std::vector<uint8_t> texture = NoiseTexture(16, 7);
  FrameRendererOptions options;
  options.background = {9, 99, 199};
  for (const bool anti_alias : {false, true}) {
    options.anti_alias = anti_alias;
    for (const double shift : {-1e5, 1e5}) {  // behind the camera, and beside the picture
      Scene away = scene;
      away.projection.col(3) += shift < 0 ? Eigen::Vector3d(0, 0, shift) : Eigen::Vector3d(shift * 1e4, 0, 0);
      const ImageU8 picture = Draw(away, texture, options);
      for (int i = 0; i < 200 * 130; ++i) {
        const uint8_t* const pixel = picture.values().data() + 4 * i;
        ASSERT_TRUE(pixel[0] == 9 && pixel[1] == 99 && pixel[2] == 199 && pixel[3] == 255) << i;
      }
    }
  }
}

TEST(FrameRendererTest, OpacityCountsSamples) {
  const Scene scene = HeadScene(130, 120);
  const std::vector<uint8_t> texture = NoiseTexture(64, 8);
  std::vector<int> count(static_cast<size_t>(scene.width) * scene.height);
  for (int s = 0; s < kMostSamples; ++s) {
    Eigen::Matrix3d shifted = Eigen::Matrix3d::Identity();
    shifted(0, 2) = -kSampleX[s] / 16.0, shifted(1, 2) = -kSampleY[s] / 16.0;
    const FragmentImage sampled =
        Rasterize(scene.vertices, scene.topology.triangles, shifted * scene.projection, scene.width, scene.height);
    for (size_t i = 0; i < count.size(); ++i) count[i] += sampled.fragments[i].triangle >= 0;
  }
  for (const RasterKernel* kernel : AvailableRasterKernels()) {
    FrameRendererOptions options = With(kernel);
    options.anti_alias = true;
    const ImageU8 picture = Draw(scene, texture, options);
    int partly = 0;
    for (size_t i = 0; i < count.size(); ++i) {
      ASSERT_EQ(picture.values()[4 * i + 3], (255 * count[i] + 4) / 8) << kernel->name << ' ' << i;
      partly += count[i] > 0 && count[i] < 8;
    }
    EXPECT_GT(partly, 100);
  }
}

TEST(FrameRendererTest, EdgesMixLight) {
  // A square over the left 3 1/2 pixels of 8: half of the fourth column's samples.
  Scene scene;
  scene.width = scene.height = 8;
  scene.projection << 100, 0, 0, 0, 0, 100, 0, 0, 0, 0, 1, 0;  // at 100 mm a millimetre is a pixel
  scene.vertices.resize(4, 3);
  scene.vertices << -9, -9, 100, 3.5f, -9, 100, 3.5f, 20, 100, -9, 20, 100;
  scene.topology.vertex_count = 4;
  scene.topology.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  scene.topology.triangles = scene.topology.triangle_uvs = {{0, 2, 1}, {0, 3, 2}};
  std::vector<uint8_t> texture(4 * 16 * 16, 200);
  for (int i = 0; i < 256; ++i) texture[4 * i + 3] = 255;
  FrameRendererOptions options;
  options.anti_alias = true;
  options.background = {0, 64, 200};
  const ImageU8 mixed = Draw(scene, texture, options);
  // As in RenderTest.EdgesMixLight: half of the light of 200, and of 200 and 64.
  EXPECT_EQ(mixed.at(3, 4)[0], 146);
  EXPECT_EQ(mixed.at(3, 4)[1], 152);
  EXPECT_EQ(mixed.at(3, 4)[2], 200);
  EXPECT_EQ(mixed.at(2, 4)[0], 200);
  EXPECT_EQ(mixed.at(4, 4)[1], 64);
  options.transparent = true;
  const ImageU8 clear = Draw(scene, texture, options);
  EXPECT_EQ(clear.at(3, 4)[0], 200);
  EXPECT_EQ(clear.at(3, 4)[3], 128);
  EXPECT_EQ(clear.at(4, 4)[0] | clear.at(4, 4)[3], 0);
}

TEST(FrameRendererTest, OptionsAreChecked) {
  FrameRendererOptions options;
  options.kernel = "fast";
  EXPECT_NE(ErrorOf([&] { options.Check(); }).find("portable"), std::string::npos);
  options = {};
  options.near_mm = 0;
  EXPECT_NE(ErrorOf([&] { options.Check(); }).find("near plane"), std::string::npos);
  options = {};
  options.threads = 0;
  EXPECT_NE(ErrorOf([&] { options.Check(); }).find("threads"), std::string::npos);
}

}  // namespace
}  // namespace likeness
