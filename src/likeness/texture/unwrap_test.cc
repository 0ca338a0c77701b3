#include "likeness/texture/unwrap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "likeness/base/testing.h"
#include "likeness/texture/test_scene.h"
#include "likeness/texture/texture_sums.h"

namespace likeness {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr int kSize = 96;

UnwrapOptions Options() {
  UnwrapOptions options;
  options.size = kSize;
  return options;
}

class UnwrapTest : public ::testing::Test {
 protected:
  Vector2d TexelUv(int x, int y) const { return {(x + 0.5) / kSize, 1 - (y + 0.5) / kSize}; }

  Vector3d Vertex(int triangle, int corner) const {
    return head_.vertices.row(head_.topology.triangles[static_cast<size_t>(triangle)][corner]).cast<double>();
  }
  Vector3d PointInHead(const TexelMap::Texel& texel) const {
    return (1.0 - texel.b1 - texel.b2) * Vertex(texel.triangle, 0) + double{texel.b1} * Vertex(texel.triangle, 1) +
           double{texel.b2} * Vertex(texel.triangle, 2);
  }

  // uvs of the four pixels around a position.
  std::vector<Vector2d> FootprintUvs(const TestPicture& picture, const Vector2d& pixel) const {
    const int x = static_cast<int>(pixel.x() - 0.5), y = static_cast<int>(pixel.y() - 0.5);
    std::vector<Vector2d> uvs;
    for (const int dy : {0, 1}) {
      for (const int dx : {0, 1}) {
        uvs.push_back(picture.uvs[static_cast<size_t>(y + dy) * picture.image.width() + x + dx]);
      }
    }
    return uvs;
  }

  const TestHead head_;
  const TexelMap texels_ = MapTexels(head_.topology, kSize);
  const FrameUnwrapper unwrapper_ = FrameUnwrapper(head_.topology, texels_, head_.vertices, Options());
};

// Ray against triangle in double (Moeller and Trumbore 1997): the distance from the ray's reach of the triangle's
// inside, as barycentric weights, and t. `inside` > 0 is a hit, < 0 a miss; near 0 the ray touches an edge.
struct Crossing {
  double inside = -1;
  double t = 0;
};

Crossing Cross(const Vector3d& origin, const Vector3d& direction, const Vector3d& a, const Vector3d& b,
               const Vector3d& c) {
  const Vector3d e1 = b - a, e2 = c - a, p = direction.cross(e2);
  const double determinant = e1.dot(p);
  if (std::abs(determinant) < 1e-12) return {};
  const Vector3d s = origin - a, q = s.cross(e1);
  const double b1 = s.dot(p) / determinant, b2 = direction.dot(q) / determinant;
  return {std::min({b1, b2, 1 - b1 - b2}), e2.dot(q) / determinant};
}

TEST_F(UnwrapTest, VisibilityEqualsBruteForce) {
  constexpr double kEdge = 1e-4;    // barycentric weight: float rays pass either side of an edge this close
  constexpr double kCosine = 1e-5;  // and either side of the grazing angle
  const double min_cosine = std::cos(80 * std::numbers::pi / 180);
  int seen = 0, occluded = 0, unsure = 0, covered = 0;
  for (const Camera& camera : TestCameras(3, 64, 64)) {
    const Vector3d centre = TestPose().Inverse() * camera.CentreInWorld();
    const ImageU8 mask = unwrapper_.Visibility(centre);
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const TexelMap::Texel& texel = texels_.at(x, y);
        const int result = *mask.at(x, y);
        ASSERT_TRUE(result == 0 || result == 255);
        if (texel.triangle < 0) {
          ASSERT_EQ(result, 0);
          continue;
        }
        ++covered;
        const Vector3d point = PointInHead(texel), to_camera = (centre - point).normalized();
        const Vector3d a = Vertex(texel.triangle, 0), b = Vertex(texel.triangle, 1), c = Vertex(texel.triangle, 2);
        const Vector3d normal = (b - a).cross(c - a);
        const double cosine = normal.norm() > 1e-4 ? normal.normalized().dot(to_camera) : -1;  // the poles have no area
        bool certainly_hidden = cosine < min_cosine - kCosine, perhaps_hidden = cosine < min_cosine + kCosine;
        const bool facing = !perhaps_hidden;
        for (int t = 0; t < static_cast<int>(head_.topology.triangles.size()); ++t) {
          if (t == texel.triangle) continue;
          const Crossing crossing = Cross(point, to_camera, Vertex(t, 0), Vertex(t, 1), Vertex(t, 2));
          const double clearance = unwrapper_.clearance_mm();
          certainly_hidden |= crossing.inside > kEdge && crossing.t > 2 * clearance;
          perhaps_hidden |= crossing.inside > -kEdge && crossing.t > 0;
        }
        if (certainly_hidden) {
          EXPECT_EQ(result, 0) << camera.name << " texel " << x << ", " << y;
        } else if (!perhaps_hidden) {
          EXPECT_EQ(result, 255) << camera.name << " texel " << x << ", " << y;
        } else {
          ++unsure;
        }
        seen += result == 255 ? 1 : 0;
        occluded += facing && certainly_hidden ? 1 : 0;
      }
    }
  }
  // The scene has all kinds, and next to nothing is left open.
  EXPECT_GT(seen, covered / 4);
  EXPECT_GT(occluded, covered / 50);
  EXPECT_LT(unsure, covered / 200);
}

TEST_F(UnwrapTest, TheTextureComesBackWhereItIsSeen) {
  for (const Camera& camera : TestCameras(3, 400, 300)) {
    const TestPicture picture = DrawTestHead(head_, camera, TestPose());
    const UnwrappedView view = unwrapper_.Unwrap(camera, TestPose(), picture.image, &picture.mask);
    const ImageU8 visible = unwrapper_.Visibility(TestPose().Inverse() * camera.CentreInWorld());
    int seen = 0, compared = 0;
    double total_error = 0, largest_error = 0;
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const uint8_t* texel = view.texture.at(x, y);
        if (*view.mask.at(x, y) == 0) {
          ASSERT_EQ(texel[0] + texel[1] + texel[2], 0);
          continue;
        }
        ++seen;
        ASSERT_EQ(*visible.at(x, y), 255);
        ASSERT_GT(std::min({texel[0], texel[1], texel[2]}), 0);
        const Vector2d uv = TexelUv(x, y);
        double reach = 0;  // of the four pixels, in uv
        for (const Vector2d& pixel_uv :
             FootprintUvs(picture, camera.Project(TestPose() * PointInHead(texels_.at(x, y))))) {
          ASSERT_GE(pixel_uv.x(), 0);  // inside the mask
          reach = std::max(reach, (pixel_uv - uv).norm());
        }
        const Vector3d truth = TestTexture(uv);
        for (int c = 0; c < 3; ++c) {
          const double error = std::abs(truth[c] - texel[c]);
          // A mean of four pixels, whose textures differ from the texel's by at most slope times reach, rounded twice.
          EXPECT_LE(error, 1 + kTextureSlope * reach) << camera.name << " texel " << x << ", " << y;
          // Where the four pixels do not straddle a fold, interpolation is good to second order.
          if (reach > 0.01) continue;
          total_error += error;
          largest_error = std::max(largest_error, error);
          ++compared;
        }
      }
    }
    EXPECT_GT(seen, kSize * kSize / 5);
    EXPECT_GT(compared, 3 * seen * 0.9);
    EXPECT_LT(total_error / compared, 0.35);  // rounding alone makes 0.25
    EXPECT_LT(largest_error, 1.5);
  }
}

TEST_F(UnwrapTest, DrawingTheUnwrappedTextureGivesBackTheImage) {
  const Camera camera = TestCameras(3, 320, 240)[1];
  const TestPicture picture = DrawTestHead(head_, camera, TestPose());
  const UnwrappedView view = unwrapper_.Unwrap(camera, TestPose(), picture.image, &picture.mask);
  int head = 0, drawn = 0;
  double squares = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vector2d uv = picture.uvs[static_cast<size_t>(y) * camera.width + x];
      if (uv.x() < 0) continue;
      ++head;
      const double tx = uv.x() * kSize - 0.5, ty = (1 - uv.y()) * kSize - 0.5;
      const int x0 = static_cast<int>(tx), y0 = static_cast<int>(ty);
      const double right = tx - x0, lower = ty - y0;
      double weights = 0;
      Vector3d colour = Vector3d::Zero();
      for (const int dy : {0, 1}) {
        for (const int dx : {0, 1}) {
          if (*view.mask.at(x0 + dx, y0 + dy) == 0) continue;
          const double weight = (dx != 0 ? right : 1 - right) * (dy != 0 ? lower : 1 - lower);
          weights += weight;
          const uint8_t* texel = view.texture.at(x0 + dx, y0 + dy);
          colour += weight * Vector3d(texel[0], texel[1], texel[2]);
        }
      }
      if (weights < 0.999) continue;
      ++drawn;
      const uint8_t* pixel = picture.image.at(x, y);
      squares += (colour - Vector3d(pixel[0], pixel[1], pixel[2])).squaredNorm() / 3;
    }
  }
  EXPECT_GT(drawn, 0.8 * head);
  EXPECT_LT(squares / drawn, 1.5);  // PSNR over 46 dB; rounding alone makes 0.2
}

TEST_F(UnwrapTest, OutsideTheImageAndOutsideTheMaskNothingIsSeen) {
  Camera camera = TestCameras(3, 200, 200)[1];
  camera.intrinsics(0, 2) += 80;  // the head leaves the picture on the right
  const TestPicture picture = DrawTestHead(head_, camera, TestPose());
  ImageU8 mask = picture.mask;
  for (int y = 0; y < 100; ++y) std::fill_n(mask.row(y), 200, static_cast<uint8_t>(0));
  *mask.at(150, 150) = 254;  // not wholly head
  const UnwrappedView masked = unwrapper_.Unwrap(camera, TestPose(), picture.image, &mask);
  const UnwrappedView unmasked = unwrapper_.Unwrap(camera, TestPose(), picture.image, nullptr);
  const ImageU8 visible = unwrapper_.Visibility(TestPose().Inverse() * camera.CentreInWorld());
  int inside = 0, outside = 0, near_border = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      if (*visible.at(x, y) == 0) {
        EXPECT_EQ(*unmasked.mask.at(x, y), 0);
        continue;
      }
      const Vector2d pixel = camera.Project(TestPose() * PointInHead(texels_.at(x, y)));
      // Within a rounding error of the limits either answer is right.
      if (std::abs(pixel.x() - 199.5) > 1e-3) {
        EXPECT_EQ(*unmasked.mask.at(x, y) != 0, pixel.x() < 199.5);
        (pixel.x() < 199.5 ? inside : outside) += 1;
      }
      if (*masked.mask.at(x, y) != 0) {
        EXPECT_GT(pixel.y(), 100.499);
        EXPECT_GT(std::max(std::abs(pixel.x() - 150.5), std::abs(pixel.y() - 150.5)), 0.999);
        for (const Vector2d& uv : FootprintUvs(picture, pixel)) EXPECT_GE(uv.x(), 0);
      }
      near_border += pixel.y() > 99.5 && pixel.y() < 100.5 ? 1 : 0;
    }
  }
  EXPECT_GT(inside, 500);
  EXPECT_GT(outside, 100);
  EXPECT_GT(near_border, 5);
}

TEST_F(UnwrapTest, BlackIsSeenAndBehindTheCameraIsNot) {
  const Camera camera = TestCameras(1, 100, 100)[0];
  const UnwrappedView black = unwrapper_.Unwrap(camera, TestPose(), ImageU8(100, 100, 3, 0), nullptr);
  int seen = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      seen += *black.mask.at(x, y) != 0 ? 1 : 0;
      EXPECT_EQ(black.texture.at(x, y)[1], *black.mask.at(x, y) != 0 ? 1 : 0);
    }
  }
  EXPECT_GT(seen, 1000);
  Camera away = camera;
  away.cam_from_world.rotation.row(0) *= -1;
  away.cam_from_world.rotation.row(2) *= -1;
  away.cam_from_world.translation = -away.cam_from_world.rotation * camera.CentreInWorld();
  const UnwrappedView behind = unwrapper_.Unwrap(away, TestPose(), ImageU8(100, 100, 3, 99), nullptr);
  EXPECT_EQ(behind.mask, ImageU8(kSize, kSize, 1));
}

TEST_F(UnwrapTest, SizesThatAreNoMultipleOfFour) {
  UnwrapOptions options;
  options.size = 33;
  const TexelMap texels = MapTexels(head_.topology, 33);
  const FrameUnwrapper unwrapper(head_.topology, texels, head_.vertices, options);
  const Camera camera = TestCameras(1, 200, 200)[0];
  const TestPicture picture = DrawTestHead(head_, camera, TestPose());
  const UnwrappedView view = unwrapper.Unwrap(camera, TestPose(), picture.image, nullptr);
  ASSERT_EQ(view.texture.width(), 33);
  const TestHead& head = head_;
  int seen = 0;
  for (int y = 0; y < 33; ++y) {
    for (int x = 0; x < 33; ++x) {
      if (*view.mask.at(x, y) == 0) continue;
      ++seen;
      const TexelMap::Texel& texel = texels.at(x, y);
      const Vector3d truth = TestTexture(UvAt(head.topology, texel.triangle, texel.b1, texel.b2));
      EXPECT_NEAR(view.texture.at(x, y)[0], truth[0], 60);  // far off where rows are shifted
    }
  }
  EXPECT_GT(seen, 200);
}

TEST_F(UnwrapTest, SumsGiveEquationOneAndTheVariance) {
  std::vector<UnwrappedView> views;
  TextureSums sums(kSize), first(kSize), rest(kSize);
  for (const Camera& camera : TestCameras(3, 200, 150)) {
    const TestPicture picture = DrawTestHead(head_, camera, TestPose(), 0.3 * static_cast<double>(views.size()));
    views.push_back(unwrapper_.Unwrap(camera, TestPose(), picture.image, &picture.mask));
    sums.Add(views.back());
    (views.size() == 1 ? first : rest).Add(views.back());
  }
  first.Add(rest);
  EXPECT_EQ(first.Average(), sums.Average());
  EXPECT_EQ(first.Variance(), sums.Variance());
  EXPECT_EQ(first.views(), 3);

  const ImageU8 average = sums.Average(), filled = sums.FilledAverage();
  double squares = 0, count = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      for (int c = 0; c < 3; ++c) {
        double weighted = 0, weights = 0;
        for (const UnwrappedView& view : views) {
          const double w = *view.mask.at(x, y) / 255.0;
          weighted += w * view.texture.at(x, y)[c];
          weights += w;
        }
        if (weights == 0) {
          EXPECT_EQ(average.at(x, y)[c], 0);
          EXPECT_GT(filled.at(x, y)[c], 0);
          continue;
        }
        const double mean = weighted / weights;
        EXPECT_LE(std::abs(average.at(x, y)[c] - mean), 0.5 + 1e-9);
        EXPECT_EQ(filled.at(x, y)[c], average.at(x, y)[c]);
        for (const UnwrappedView& view : views) {
          if (*view.mask.at(x, y) == 0) continue;
          squares += (view.texture.at(x, y)[c] - mean) * (view.texture.at(x, y)[c] - mean);
          count += 1;
        }
      }
    }
  }
  EXPECT_GT(squares, 0);
  EXPECT_NEAR(sums.Variance(), squares / count, 1e-9 * squares / count);
}

TEST(VertexSumsTest, MeanAndVarianceEqualTheirDefinitions) {
  VertexSums sums;
  std::vector<Vertices> meshes;
  for (int i = 0; i < 4; ++i) {
    meshes.push_back(Vertices::Random(10, 3) + Vertices::Constant(10, 3, 100));
    sums.Add(meshes.back());
  }
  const std::vector<float> mean = sums.Mean();
  double squares = 0;
  for (Eigen::Index i = 0; i < 30; ++i) {
    double plain = 0;
    for (const Vertices& mesh : meshes) plain += mesh.data()[i] / 4.0;
    EXPECT_NEAR(mean[static_cast<size_t>(i)], plain, 1e-5);
    for (const Vertices& mesh : meshes) squares += (mesh.data()[i] - plain) * (mesh.data()[i] - plain);
  }
  EXPECT_NEAR(sums.Variance(), squares / 120, 1e-9);
}

TEST(UnwrapOptionsTest, ValuesOutOfRangeAreNamed) {
  UnwrapOptions options;
  options.size = 8;
  EXPECT_THAT(ErrorOf([&] { options.Check(); }), HasSubstr("--size 8"));
  options.size = 100000;
  EXPECT_THAT(ErrorOf([&] { options.Check(); }), HasSubstr("--size 100000"));
  options.size = 512;
  options.grazing_deg = 90;
  EXPECT_THAT(ErrorOf([&] { options.Check(); }), HasSubstr("--grazing 90"));
  options.grazing_deg = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(ErrorOf([&] { options.Check(); }), HasSubstr("--grazing nan"));
}

}  // namespace
}  // namespace likeness
