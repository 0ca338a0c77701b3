#include "likeness/render/portrait.h"

#include <gtest/gtest.h>

#include "likeness/base/testing.h"

namespace likeness {
namespace {

struct Box {
  Vertices vertices;
  MeshTopology topology;
};

// An upright box around (10, 20, 5) and a far vertex that no triangle uses.
Box MakeBox() {
  Box box;
  box.vertices.resize(9, 3);
  for (int i = 0; i < 8; ++i) {
    box.vertices.row(i) << ((i & 1) != 0 ? 90.f : -70.f), ((i & 2) != 0 ? 140.f : -100.f),
        ((i & 4) != 0 ? 95.f : -85.f);
  }
  box.vertices.row(8) << 5000, 5000, 5000;
  box.topology.vertex_count = 9;
  box.topology.triangles = {{0, 1, 2}, {3, 4, 5}, {5, 6, 7}};
  return box;
}

TEST(PortraitTest, FitsTheMesh) {
  const Box box = MakeBox();
  for (const double azimuth : {0.0, 90.0, -37.0, 180.0}) {
    for (const double elevation : {0.0, 60.0, -89.0}) {
      PortraitOptions options;
      options.azimuth_deg = azimuth, options.elevation_deg = elevation;
      const Camera camera = PortraitCamera(box.vertices, box.topology, options);
      double largest = 0;
      for (int i = 0; i < 8; ++i) {
        const Eigen::Vector2d pixel = camera.Project(box.vertices.row(i).transpose().cast<double>());
        largest = std::max({largest, std::abs(pixel.x() / 512 - 0.5), std::abs(pixel.y() / 768 - 0.5)});
      }
      EXPECT_NEAR(largest, 0.44, 1e-6) << azimuth << ' ' << elevation;
      EXPECT_NEAR((camera.CentreInWorld() - Eigen::Vector3d(10, 20, 5)).norm(), 1100, 1e-6);
    }
  }
}

TEST(PortraitTest, TurnsToTheSubjectsLeftAndUp) {
  const Box box = MakeBox();
  PortraitOptions options;
  options.azimuth_deg = 90;
  options.elevation_deg = 30;
  options.focal_px = 1234;
  const Camera camera = PortraitCamera(box.vertices, box.topology, options);
  EXPECT_NEAR(camera.CentreInWorld().x(), 10 + 1100 * std::cos(M_PI / 6), 1e-6);
  EXPECT_NEAR(camera.CentreInWorld().y(), 20 + 550, 1e-6);
  EXPECT_EQ(camera.intrinsics(0, 0), 1234);
  // Up in the head is up in the picture; the nose (z) points to the picture's left.
  EXPECT_LT(camera.Project({10, 60, 5}).y(), camera.Project({10, 20, 5}).y());
  EXPECT_LT(camera.Project({10, 20, 60}).x(), camera.Project({10, 20, 5}).x());
}

TEST(PortraitTest, ViewsAreParsed) {
  double azimuth = 0, elevation = 0;
  ParseView("30,-12.5", &azimuth, &elevation);
  EXPECT_EQ(azimuth, 30);
  EXPECT_EQ(elevation, -12.5);
  for (const char* wrong : {"", "30", "30,", ",5", "a,b", "1,2,3", "1;2", "nan,0", "1,inf", "1,2 "}) {
    EXPECT_NE(ErrorOf([&] { ParseView(wrong, &azimuth, &elevation); }), "") << wrong;
  }
}

TEST(PortraitTest, OptionsAreChecked) {
  const auto error = [](auto&& change) {
    PortraitOptions options;
    change(options);
    return ErrorOf([&] { options.Check(); });
  };
  EXPECT_EQ(error([](PortraitOptions&) {}), "");
  EXPECT_NE(error([](PortraitOptions& o) { o.elevation_deg = 90; }), "");
  EXPECT_NE(error([](PortraitOptions& o) { o.width = 0; }), "");
  EXPECT_NE(error([](PortraitOptions& o) { o.height = 1 << 20; }), "");
  EXPECT_NE(error([](PortraitOptions& o) { o.focal_px = -1; }), "");
  EXPECT_NE(error([](PortraitOptions& o) { o.distance_mm = 10; }), "");
}

}  // namespace
}  // namespace likeness
