// OpenGL's pictures against the CPU's.

#include "likeness/render/gl/mesh_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/random.h"
#include "likeness/gl/testing.h"
#include "likeness/image/resize.h"
#include "likeness/image/srgb.h"
#include "likeness/render/gl/canvas.h"
#include "likeness/render/portrait.h"
#include "likeness/render/rasterizer.h"

namespace likeness {
namespace {

constexpr int kGrid = 16;  // cells a side
constexpr std::array<float, 3> kBackground = {51, 102, 153};

// The part of an ellipsoid that faces forward, 90 degrees each way. Its left and right half are charts of their own, so
// that vertices on the seam have two uvs.
struct Shell {
  Vertices vertices = Vertices((kGrid + 1) * (kGrid + 1), 3);
  MeshTopology topology;

  Shell() {
    const auto at = [](int i, int j) { return j * (kGrid + 1) + i; };
    topology.vertex_count = static_cast<int>(vertices.rows());
    for (int j = 0; j <= kGrid; ++j) {
      for (int i = 0; i <= kGrid; ++i) {
        const float longitude = (static_cast<float>(i) / kGrid - 0.5f) * 1.57f;
        const float latitude = (static_cast<float>(j) / kGrid - 0.5f) * 1.57f;
        vertices.row(at(i, j)) << 80 * std::sin(longitude) * std::cos(latitude), 110 * std::sin(latitude),
            95 * std::cos(longitude) * std::cos(latitude);
      }
    }
    const int uvs_a_row = kGrid + 2;  // the seam's column twice
    for (int j = 0; j <= kGrid; ++j) {
      for (int i = 0; i < uvs_a_row; ++i) {
        const bool right = i > kGrid / 2;
        const float u = static_cast<float>(right ? i - 1 - kGrid / 2 : i) / kGrid;
        topology.uvs.emplace_back(right ? 0.95f - u * 0.9f : 0.05f + u * 0.8f, static_cast<float>(j) / kGrid);
      }
    }
    for (int j = 0; j < kGrid; ++j) {
      for (int i = 0; i < kGrid; ++i) {
        const int u = i >= kGrid / 2 ? i + 1 : i, uv = j * uvs_a_row + u;
        topology.triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
        topology.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
        topology.triangle_uvs.emplace_back(uv, uv + 1, uv + 1 + uvs_a_row);
        topology.triangle_uvs.emplace_back(uv, uv + 1 + uvs_a_row, uv + uvs_a_row);
      }
    }
    topology.Check("shell");
  }

  bool InRightChart(int triangle) const { return triangle / 2 % kGrid >= kGrid / 2; }
};

class GlMeshRendererTest : public WithContext<testing::Test> {
 protected:
  // Of the shell, from a side, with the head turned and moved.
  void Aim(int width, int height, double azimuth_deg) {
    PortraitOptions view;
    view.azimuth_deg = azimuth_deg;
    view.elevation_deg = 10;
    view.width = width;
    view.height = height;
    camera_ = PortraitCamera(shell_.vertices, shell_.topology, view);
    world_from_head_ = {RotationFromYawPitchRoll(0.3, -0.2, 0.1), {30, -20, 50}};
    camera_.cam_from_world = camera_.cam_from_world * world_from_head_.Inverse();
  }

  ImageU8 Draw(const ImageU8& rgba, int samples, const MeshStyle& style = {}) const {
    const GlFunctions& gl = this->gl();
    GlMeshRenderer renderer(gl);
    renderer.SetTopology(shell_.topology);
    renderer.SetVertices(shell_.vertices);
    GlTextureStream texture(gl);
    texture.Upload(rgba.values().data(), rgba.width());
    GlCanvas canvas(gl, camera_.width, camera_.height, samples);
    canvas.Begin({kBackground[0] / 255, kBackground[1] / 255, kBackground[2] / 255});
    renderer.Draw(texture.id(), camera_, world_from_head_, 0, style);
    canvas.End();
    ImageU8 picture = canvas.Read();
    CheckGlErrors(gl, "drawing a mesh");
    return picture;
  }

  ImageU8 DrawOnCpu(const ImageU8& rgba, int supersample) const {
    ImageF rgb(rgba.width(), rgba.height(), 3);
    for (int y = 0; y < rgba.height(); ++y) {
      for (int x = 0; x < rgba.width(); ++x) std::copy_n(rgba.at(x, y), 3, rgb.at(x, y));
    }
    DrawOptions options;
    options.supersample = supersample;
    options.background = kBackground;
    options.linear_edges = false;  // as OpenGL mixes samples
    return DrawMesh(shell_.vertices, shell_.topology, rgb, camera_, world_from_head_, options).colour;
  }

  FragmentImage Fragments() const {
    return Rasterize(shell_.vertices, shell_.topology.triangles, camera_, world_from_head_);
  }

  // Whether no silhouette and no seam comes near a pixel.
  bool Inside(const FragmentImage& fragments, int x, int y) const {
    if (x < 1 || y < 1 || x + 1 >= fragments.width || y + 1 >= fragments.height) return false;
    std::set<int> charts;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int triangle = fragments.at(x + dx, y + dy).triangle;
        charts.insert(triangle < 0 ? -1 : shell_.InRightChart(triangle));
      }
    }
    return charts.size() == 1 && !charts.contains(-1);
  }

  Shell shell_;
  Camera camera_;
  RigidTransform world_from_head_;
};

ImageU8 NoiseTexture(int size) {
  ImageU8 texture(size, size, 4, 255);
  Random random(3);
  for (uint8_t& value : texture.values()) value = static_cast<uint8_t>(random.Below(256));
  return texture;
}

ImageU8 PlainTexture(uint8_t value) { return ImageU8(16, 16, 4, value); }

TEST_F(GlMeshRendererTest, AgreesWithTheCpuButForEdges) {
  Aim(240, 320, 20);
  // So few texels that each is larger than a pixel everywhere: then both sample the texture itself, bilinearly.
  const ImageU8 texture = NoiseTexture(32);
  const ImageU8 ours = Draw(texture, 1), cpu = DrawOnCpu(texture, 1);
  const FragmentImage fragments = Fragments();
  int inside = 0, largest = 0, background = 0;
  for (int y = 0; y < cpu.height(); ++y) {
    for (int x = 0; x < cpu.width(); ++x) {
      if (!Inside(fragments, x, y)) continue;
      ++inside;
      for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(ours.at(x, y)[c] - cpu.at(x, y)[c]));
    }
    background += std::equal(ours.at(0, y), ours.at(0, y) + 3, kBackground.begin());
  }
  EXPECT_GT(inside, 20000);
  EXPECT_EQ(background, cpu.height());
  // Devices place a sample between texels in steps of 1/256, which is 255/256 each way, and may cut the result of each
  // of two interpolations to 8 bits, 1 each; the CPU's is rounded, 1/2.
  EXPECT_LE(largest, 4);
}

TEST_F(GlMeshRendererTest, SeenSmallTexelsAreAveraged) {
  Aim(24, 32, 0);
  ImageU8 texture(256, 256, 4, 255);  // some 13 texels a pixel
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) std::fill_n(texture.at(x, y), 3, static_cast<uint8_t>((x + y) % 2 * 255));
  }
  const ImageU8 picture = Draw(texture, 1);
  const FragmentImage fragments = Fragments();
  int inside = 0;
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      if (!Inside(fragments, x, y)) continue;
      ++inside;
      EXPECT_NEAR(*picture.at(x, y), 127.5, 2) << x << " " << y;  // the first level is 127 or 128
    }
  }
  EXPECT_GT(inside, 200);
}

TEST_F(GlMeshRendererTest, EdgesAreSmooth) {
  Aim(120, 160, 20);
  const ImageU8 smooth = Draw(PlainTexture(255), 4), cpu = DrawOnCpu(PlainTexture(255), 8);
  double error = 0;
  int edges = 0;
  for (int y = 0; y < cpu.height(); ++y) {
    for (int x = 0; x < cpu.width(); ++x) {
      const int red = *cpu.at(x, y);
      if (red == 255 || red == static_cast<int>(kBackground[0])) continue;
      ++edges;
      error += std::abs(red - *smooth.at(x, y)) / (255.0 - kBackground[0]);
    }
  }
  EXPECT_GT(edges, 200);
  // Four samples err by 1/8 at most on an edge that they divide evenly, by 1/16 on the average; unsmoothed, by 1/4.
  EXPECT_LT(error / edges, 0.125);
}

TEST_F(GlMeshRendererTest, BackFacesAreCulled) {
  Aim(60, 80, 180);
  MeshStyle style;
  const auto lit = [&] {
    const ImageU8 picture = Draw(PlainTexture(255), 1, style);
    int count = 0;
    for (int i = 0; i < 60 * 80; ++i) count += picture.at(i % 60, i / 60)[0] == 255;
    return count;
  };
  EXPECT_EQ(lit(), 0);
  style.cull_back_faces = false;
  EXPECT_GT(lit(), 1000);
}

TEST_F(GlMeshRendererTest, AStopDoublesTheLight) {
  Aim(30, 40, 0);
  MeshStyle style;
  style.exposure = 2;
  const float expected = 255 * SrgbFromLinear(2 * LinearFromSrgb(100 / 255.0f));
  EXPECT_NEAR(*Draw(PlainTexture(100), 1, style).at(15, 20), expected, 1);
}

}  // namespace
}  // namespace likeness
