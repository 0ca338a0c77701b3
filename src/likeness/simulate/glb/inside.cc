#include "likeness/simulate/glb/inside.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "likeness/base/parallel.h"
#include "likeness/geometry/ray_scene.h"
#include "likeness/simulate/glb/triangles.h"

namespace likeness {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

Vector3f Centroid(const Vertices& positions, const Vector3i& t) {
  return (positions.row(t[0]) + positions.row(t[1]) + positions.row(t[2])).transpose() / 3;
}

// The triangles across the three edges, -1 for none.
std::vector<std::array<int, 3>> Neighbours(const std::vector<Vector3i>& triangles) {
  const EdgeMap edges(triangles);
  std::vector<std::array<int, 3>> neighbours;
  for (const Vector3i& t : triangles) {
    neighbours.push_back({edges.Left(t[1], t[0]), edges.Left(t[2], t[1]), edges.Left(t[0], t[2])});
  }
  return neighbours;
}

// Triangles that edges connect with `start`, all of them with `inside` true.
std::vector<int> Flood(const std::vector<std::array<int, 3>>& neighbours, const std::vector<bool>& inside, int start,
                       std::vector<bool>* reached) {
  std::vector<int> piece = {start};
  (*reached)[start] = true;
  for (size_t i = 0; i < piece.size(); ++i) {
    for (const int n : neighbours[piece[i]]) {
      if (n < 0 || !inside[n] || (*reached)[n]) continue;
      (*reached)[n] = true;
      piece.push_back(n);
    }
  }
  return piece;
}

// Straightens the border of a set: triangles that differ from two of their neighbours change sides.
void Straighten(const std::vector<std::array<int, 3>>& neighbours, std::vector<bool>* inside) {
  for (int round = 0; round < 20; ++round) {
    bool changed = false;
    for (size_t t = 0; t < inside->size(); ++t) {
      int differ = 0;
      for (const int n : neighbours[t]) differ += n >= 0 && (*inside)[n] != (*inside)[t] ? 1 : 0;
      if (differ >= 2) (*inside)[t] = !(*inside)[t], changed = true;
    }
    if (!changed) break;
  }
}

std::vector<Vector3f> SphereDirections(int count) {
  std::vector<Vector3f> directions;
  for (int i = 0; i < count; ++i) {
    const float z = 1 - 2 * (static_cast<float>(i) + 0.5f) / static_cast<float>(count);
    const float angle = static_cast<float>(i) * std::numbers::pi_v<float> * (3 - std::sqrt(5.0f));
    const float r = std::sqrt(1 - z * z);
    directions.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
  }
  return directions;
}

}  // namespace

std::vector<bool> SeenInFrontOfEye(const Vertices& positions, const std::vector<Vector3i>& triangles,
                                   const ModelEye& eye) {
  RayScene scene;
  scene.Add(positions, triangles);
  scene.Build();
  std::vector<bool> hidden(triangles.size(), false);
  int deepest = -1;
  for (size_t t = 0; t < triangles.size(); ++t) {
    const Vector3f middle = Centroid(positions, triangles[t]);
    if ((middle - eye.centre).norm() > 2 * eye.radius) continue;
    for (const int v : triangles[t]) {
      const Vector3f p = positions.row(v), d = p - eye.centre;
      const float beside = d.head<2>().norm();
      const bool behind_ball = beside < eye.radius && d.z() < std::sqrt(eye.radius * eye.radius - beside * beside);
      if (behind_ball || scene.Occluded({p, Vector3f::UnitZ(), 0.05f, 100.0f})) hidden[t] = true;
    }
    if (!hidden[t] || (middle - eye.centre).head<2>().norm() > eye.radius) continue;
    if (deepest < 0 || middle.z() < Centroid(positions, triangles[deepest]).z()) deepest = static_cast<int>(t);
  }
  std::vector<bool> seen(triangles.size(), true);
  if (deepest < 0) return seen;
  const auto neighbours = Neighbours(triangles);
  Straighten(neighbours, &hidden);
  std::vector<bool> reached(triangles.size(), false);
  for (const int t : Flood(neighbours, hidden, deepest, &reached)) seen[t] = false;
  return seen;
}

std::vector<int> FindMouth(const Vertices& positions, const std::vector<Vector3i>& triangles) {
  RayScene scene;
  scene.Add(positions, triangles);
  scene.Build();
  constexpr int kDirections = 128;
  constexpr float kOffsetMm = 0.02f;
  const std::vector<Vector3f> directions = SphereDirections(kDirections);
  std::vector<uint8_t> hides(triangles.size(), 0);
  constexpr int64_t kChunk = 256;
  const auto count = static_cast<int64_t>(triangles.size());
  ParallelFor((count + kChunk - 1) / kChunk, [&](int64_t chunk) {
    for (int64_t i = chunk * kChunk; i < std::min(count, (chunk + 1) * kChunk); ++i) {
      const Vector3i& t = triangles[static_cast<size_t>(i)];
      const Vector3f a = positions.row(t[0]), b = positions.row(t[1]), c = positions.row(t[2]);
      const Vector3f normal = (b - a).cross(c - a).stableNormalized();
      const Vector3f from = (a + b + c) / 3 + kOffsetMm * normal;
      int seen = 0;
      for (const Vector3f& direction : directions) {
        // The border at the neck lets no one look in.
        if (direction.dot(normal) < 0.05f || direction.y() < -0.7f) continue;
        seen += scene.Occluded({from, direction}) ? 0 : 1;
      }
      hides[static_cast<size_t>(i)] = seen <= 1 ? 1 : 0;
    }
  });
  std::vector<bool> hidden(hides.begin(), hides.end());
  const auto neighbours = Neighbours(triangles);
  Straighten(neighbours, &hidden);

  // The largest hidden piece; its own holes (what a ray found between the lips) belong to it.
  std::vector<bool> reached(triangles.size(), false);
  std::vector<int> best;
  double best_area = 0;
  for (size_t t = 0; t < triangles.size(); ++t) {
    if (!hidden[t] || reached[t]) continue;
    std::vector<int> piece = Flood(neighbours, hidden, static_cast<int>(t), &reached);
    double area = 0;
    Vector3f middle = Vector3f::Zero();
    for (const int i : piece) {
      const Vector3i& q = triangles[i];
      const Vector3f a = positions.row(q[0]), b = positions.row(q[1]), c = positions.row(q[2]);
      area += (b - a).cross(c - a).norm() / 2;
      middle += (a + b + c) / (3 * static_cast<float>(piece.size()));
    }
    const bool placed = middle.y() < -15 && std::abs(middle.x()) < 25;
    if (placed && area > best_area) best_area = area, best = std::move(piece);
  }
  constexpr double kLeastAreaMm2 = 800;
  if (best_area < kLeastAreaMm2) return {};
  std::vector<bool> inside(triangles.size(), false);
  for (const int t : best) inside[t] = true;
  std::vector<bool> outside = inside;
  outside.flip();
  std::vector<bool> out_reached(triangles.size(), false);
  std::vector<int> largest;
  for (size_t t = 0; t < triangles.size(); ++t) {
    if (!outside[t] || out_reached[t]) continue;
    std::vector<int> piece = Flood(neighbours, outside, static_cast<int>(t), &out_reached);
    if (piece.size() > largest.size()) largest = std::move(piece);
  }
  std::fill(inside.begin(), inside.end(), true);
  for (const int t : largest) inside[t] = false;
  std::vector<int> mouth;
  for (size_t t = 0; t < triangles.size(); ++t) {
    if (inside[t]) mouth.push_back(static_cast<int>(t));
  }
  return mouth;
}

}  // namespace likeness
