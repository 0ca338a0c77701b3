#include "likeness/simulate/parametrise.h"

#include <gtest/gtest.h>

namespace likeness {
namespace {

constexpr int kN = 16;

// A square sheet with a tall bump in its middle, pinned at its border to the unit square.
Disc Bump(float height) {
  Disc disc;
  for (int y = 0; y <= kN; ++y) {
    for (int x = 0; x <= kN; ++x) {
      const float u = static_cast<float>(x) / kN, v = static_cast<float>(y) / kN;
      const float r2 = (u - 0.5f) * (u - 0.5f) + (v - 0.5f) * (v - 0.5f);
      disc.positions.emplace_back(u, v, height * std::exp(-r2 / 0.02f));
      if (x == 0 || y == 0 || x == kN || y == kN) {
        disc.border.emplace_back(y * (kN + 1) + x, Eigen::Vector2f(u, v));
      }
      if (x < kN && y < kN) {
        const int a = y * (kN + 1) + x;
        disc.faces.push_back({a, a + 1, a + kN + 2, a + kN + 1});
        disc.density.push_back(1);
      }
    }
  }
  return disc;
}

float Area(const std::vector<Eigen::Vector2f>& uv, const std::vector<int>& face) {
  float area = 0;
  for (size_t k = 0; k < face.size(); ++k) {
    const Eigen::Vector2f &a = uv[face[k]], &b = uv[face[(k + 1) % face.size()]];
    area += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return area;
}

TEST(MapDisc, AFlatSheetKeepsItsShape) {
  const Disc disc = Bump(0);
  const auto uv = MapDiscToRectangle(disc, 3);
  for (size_t i = 0; i < uv.size(); ++i) EXPECT_LT((uv[i] - disc.positions[i].head<2>()).norm(), 1e-5);
}

TEST(MapDisc, NoFaceIsTurnedOverAndTheRectangleIsFull) {
  const Disc disc = Bump(2);
  const auto uv = MapDiscToRectangle(disc, 10);
  float sum = 0;
  for (const auto& face : disc.faces) {
    EXPECT_GT(Area(uv, face), 0);
    sum += Area(uv, face);
  }
  EXPECT_NEAR(sum, 1, 1e-5);
}

TEST(MapDisc, RoundsGiveTheBumpMoreRoomAndDensityMoreStill) {
  Disc disc = Bump(1);
  const auto middle_area = [&](const std::vector<Eigen::Vector2f>& uv) {
    float area = 0;
    for (int y = 5; y < 11; ++y) {
      for (int x = 5; x < 11; ++x) area += Area(uv, disc.faces[y * kN + x]);
    }
    return area;
  };
  const float plain = middle_area(MapDiscToRectangle(disc, 0));
  const float even = middle_area(MapDiscToRectangle(disc, 10));
  for (int y = 5; y < 11; ++y) {
    for (int x = 5; x < 11; ++x) disc.density[y * kN + x] = 2;
  }
  const float dense = middle_area(MapDiscToRectangle(disc, 10));
  EXPECT_GT(even, 1.3f * plain);
  EXPECT_GT(dense, 1.2f * even);
}

}  // namespace
}  // namespace likeness
