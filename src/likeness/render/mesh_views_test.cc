// Which way up textures come, on a mesh with known marks and on a published sample.

#include "likeness/render/mesh_views.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "likeness/base/file.h"
#include "likeness/base/testing.h"
#include "likeness/geometry/obj.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

constexpr int kHeight = 240;
enum View { kRightSide, kFront, kLeftSide };

// A ball whose texture wraps once around it from the back: u runs from the subject's right over the front to the left,
// v upwards.
struct Ball {
  static constexpr int kAround = 40, kDown = 20;
  MeshTopology topology;
  Vertices vertices;

  Ball() {
    vertices.resize((kAround + 1) * (kDown + 1), 3);
    for (int j = 0; j <= kDown; ++j) {
      for (int i = 0; i <= kAround; ++i) {
        const double turn = 2 * std::numbers::pi * (static_cast<double>(i) / kAround - 0.5);
        const double down = std::numbers::pi * j / kDown;
        vertices.row(j * (kAround + 1) + i) << static_cast<float>(80 * std::sin(down) * std::sin(turn)),
            static_cast<float>(100 * std::cos(down)), static_cast<float>(80 * std::sin(down) * std::cos(turn));
        topology.uvs.emplace_back(static_cast<float>(i) / kAround, 1 - static_cast<float>(j) / kDown);
      }
    }
    topology.vertex_count = static_cast<int>(vertices.rows());
    for (int j = 0; j < kDown; ++j) {
      for (int i = 0; i < kAround; ++i) {
        const int a = j * (kAround + 1) + i, b = a + 1, c = a + kAround + 1, d = c + 1;
        topology.triangles.emplace_back(a, c, d);
        topology.triangles.emplace_back(a, d, b);
      }
    }
    topology.triangle_uvs = topology.triangles;
  }
};

// Rows and columns as an image viewer shows them: blue above, red at the right, green in the middle.
ImageU8 MarkedTexture() {
  ImageU8 texture(100, 100, 3, 30);
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 100; ++x) {
      if (y < 25) texture.at(x, y)[2] = 255;
      if (x >= 65) texture.at(x, y)[0] = 255;
      if (x >= 45 && x < 55 && y >= 45 && y < 55) texture.at(x, y)[1] = 255;
    }
  }
  return texture;
}

// Where a channel is bright, as shares of the picture's width and height; none of it: -1.
Eigen::Vector2d CentreOf(const ImageU8& picture, int channel) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      if (picture.at(x, y)[channel] < 200) continue;
      sum += Eigen::Vector2d((x + 0.5) / picture.width(), (y + 0.5) / picture.height());
      ++count;
    }
  }
  return count > 0 ? Eigen::Vector2d(sum / count) : Eigen::Vector2d(-1, -1);
}

TEST(MeshViewsTest, MarksAreSeenWhereTheTextureHasThem) {
  const Ball ball;
  const ImageU8 texture = MarkedTexture();
  const std::vector<Panel> views = MeshViews(ball.vertices, ball.topology, &texture, kHeight);
  ASSERT_EQ(views.size(), 3u);
  EXPECT_LT(CentreOf(views[kFront].picture, 2).y(), 0.3);   // the texture's first rows are the top of the head
  EXPECT_GT(CentreOf(views[kFront].picture, 0).x(), 0.65);  // its right is the subject's left, at the picture's right
  EXPECT_NEAR(CentreOf(views[kFront].picture, 1).x(), 0.5, 0.02);
  EXPECT_NEAR(CentreOf(views[kFront].picture, 1).y(), 0.5, 0.02);
  // From the subject's left the front turns to the picture's left, and what is red fills the right.
  EXPECT_LT(CentreOf(views[kLeftSide].picture, 1).x(), 0.25);
  EXPECT_GT(CentreOf(views[kRightSide].picture, 1).x(), 0.75);
  EXPECT_EQ(views[kLeftSide].label, "subject's left side");
}

TEST(MeshViewsTest, WithoutATextureTheShapeIsShaded) {
  const Ball ball;
  const ImageU8 front = MeshViews(ball.vertices, ball.topology, nullptr, kHeight)[kFront].picture;
  const auto brightness = [&](double x, double y) {
    return *front.at(static_cast<int>(x * front.width()), static_cast<int>(y * front.height()));
  };
  EXPECT_GT(brightness(0.55, 0.4), 150);  // lit from above and the right
  EXPECT_LT(brightness(0.2, 0.75), brightness(0.8, 0.25));
  EXPECT_EQ(brightness(0.02, 0.02), 40);  // ground
}

// The picture of the published mesh, by what is known of the man from his photograph and his texture, not by how the
// mesh and the texture are put together.
class SampleViewsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto folder = SampleData("ava256");
    if (!folder) GTEST_SKIP() << "sample data absent";
    const auto obj = *folder / "face_topology.obj";
    topology_ = TopologyFromObj(ReadObj(obj), obj.string());
    const std::vector<float> values = ReadFloats(*folder / "021924.bin", 21918);
    vertices_ = Eigen::Map<const Vertices>(values.data(), 7306, 3);
    texture_ = ReadImage(*folder / "021924_avgtex.png");
  }

  ImageU8 Front(const ImageU8& texture) const { return MeshViews(vertices_, topology_, &texture, 480)[kFront].picture; }

  MeshTopology topology_;
  Vertices vertices_;
  ImageU8 texture_;
};

// Mean of the three channels over a box, in shares of the picture.
double Brightness(const ImageU8& picture, double x0, double y0, double x1, double y1) {
  double sum = 0;
  int count = 0;
  for (int y = static_cast<int>(y0 * picture.height()); y < static_cast<int>(y1 * picture.height()); ++y) {
    for (int x = static_cast<int>(x0 * picture.width()); x < static_cast<int>(x1 * picture.width()); ++x) {
      for (int c = 0; c < 3; ++c) sum += picture.at(x, y)[c];
      count += 3;
    }
  }
  return sum / count;
}

TEST_F(SampleViewsTest, TheManStandsUpright) {
  // The texture's own marks, read off the file with an image viewer: the ear at its left (column 150) is that of the
  // subject's right, the brows are in row 250, the neck in row 950.
  ImageU8 marked(1024, 1024, 3, 30);
  for (int y = 0; y < 1024; ++y) {
    for (int x = 0; x < 1024; ++x) {
      if (y < 200) marked.at(x, y)[2] = 255;                        // forehead and above
      if (y > 900) marked.at(x, y)[1] = 255;                        // neck
      if (x > 620 && y > 250 && y < 450) marked.at(x, y)[0] = 255;  // the eye and ear at the right
    }
  }
  const ImageU8 picture = Front(marked);
  EXPECT_LT(CentreOf(picture, 2).y(), 0.3);
  EXPECT_GT(CentreOf(picture, 1).y(), 0.75);
  EXPECT_GT(CentreOf(picture, 0).x(), 0.55);
  EXPECT_LT(CentreOf(picture, 0).y(), 0.5);
  // In his own colours: under the dark eyes, cheeks are bright; the neck is skin, not hair or the dark scalp.
  const ImageU8 man = Front(texture_);
  const double eyes = Brightness(man, 0.38, 0.31, 0.62, 0.34), cheeks = Brightness(man, 0.3, 0.42, 0.42, 0.48);
  const double forehead = Brightness(man, 0.4, 0.14, 0.6, 0.2);
  EXPECT_GT(cheeks, 1.3 * eyes);
  EXPECT_GT(forehead, 1.3 * eyes);
}

}  // namespace
}  // namespace likeness
