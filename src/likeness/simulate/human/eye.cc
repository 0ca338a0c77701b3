#include "likeness/simulate/human/eye.h"

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>

namespace likeness {
namespace {

constexpr int kSegments = 48;
constexpr float kPi = std::numbers::pi_v<float>;

struct Ring {
  float radius, z, uv;
};

// A surface of revolution about z from rings outside to a last point at the pole.
EyeMesh Revolve(const std::vector<Ring>& rings, const Ring& pole) {
  EyeMesh mesh;
  std::vector<Eigen::RowVector3f> points;
  for (const Ring& ring : rings) {
    for (int s = 0; s < kSegments; ++s) {
      const float angle = 2 * kPi * s / kSegments;
      points.emplace_back(ring.radius * std::cos(angle), ring.radius * std::sin(angle), ring.z);
      mesh.topology.uvs.emplace_back(0.5f + ring.uv * std::cos(angle), 0.5f + ring.uv * std::sin(angle));
    }
  }
  const int last = static_cast<int>(points.size());
  points.emplace_back(0, 0, pole.z);
  mesh.topology.uvs.emplace_back(0.5f, 0.5f);
  const auto append = [&](int a, int b, int c) {
    mesh.topology.triangles.emplace_back(a, b, c);
    mesh.topology.triangle_uvs.emplace_back(a, b, c);
  };
  const int count = static_cast<int>(rings.size());
  for (int r = 0; r < count; ++r) {
    for (int s = 0; s < kSegments; ++s) {
      const int a = r * kSegments + s, b = r * kSegments + (s + 1) % kSegments;
      if (r + 1 == count) {
        append(a, b, last);
      } else {
        append(a, b, b + kSegments);
        append(a, b + kSegments, a + kSegments);
      }
    }
  }
  mesh.topology.vertex_count = last + 1;
  mesh.vertices.resize(last + 1, 3);
  for (int i = 0; i <= last; ++i) mesh.vertices.row(i) = points[i];
  return mesh;
}

float LimbusAngle() { return std::asin(kLimbus); }

// Where the cornea's sphere is centred on the axis, in units of the sclera's radius.
float CorneaCentre() { return std::cos(LimbusAngle()) - std::sqrt(kCorneaRadius * kCorneaRadius - kLimbus * kLimbus); }

}  // namespace

float EyeReach(float cosine) {
  // From the eye's centre to the cornea's sphere along the direction; equal to the sclera at the limbus.
  const float centre = CorneaCentre();
  const float along = centre * cosine;
  const float inside = along * along - centre * centre + kCorneaRadius * kCorneaRadius;
  return std::max(1.0f, along + std::sqrt(std::max(inside, 0.0f)));
}

EyeMesh MakeEyeball(float radius) {
  constexpr int kScleraRings = 20, kIrisRings = 8;
  constexpr float kBack = 120 * kPi / 180;
  std::vector<Ring> rings;
  const float limbus = LimbusAngle();
  for (int i = 0; i <= kScleraRings; ++i) {
    const float t = static_cast<float>(i) / kScleraRings;
    const float angle = kBack + (limbus - kBack) * t;
    rings.push_back({radius * std::sin(angle), radius * std::cos(angle), 0.49f + (kIrisInUv - 0.49f) * t});
  }
  // The iris stands a little behind the limbus and rises towards the pupil, as the lens pushes it.
  const float plane = radius * (std::cos(limbus) - 0.035f);
  for (int i = 0; i < kIrisRings; ++i) {
    const float t = 1 - static_cast<float>(i) / kIrisRings;
    rings.push_back({radius * kLimbus * 0.995f * t, plane + radius * 0.02f * (1 - t), kIrisInUv * t});
  }
  return Revolve(rings, {0, plane + radius * 0.02f, 0});
}

EyeMesh MakeCornea(float radius) {
  constexpr int kRings = 28;
  constexpr float kBack = 80 * kPi / 180;
  constexpr float kFilm = 1.004f;
  std::vector<Ring> rings;
  for (int i = 0; i < kRings; ++i) {
    const float angle = kBack * (1 - static_cast<float>(i) / kRings);
    const float reach = radius * kFilm * EyeReach(std::cos(angle));
    rings.push_back({reach * std::sin(angle), reach * std::cos(angle), 0.49f * angle / kBack});
  }
  return Revolve(rings, {0, radius * kFilm * EyeReach(1), 0});
}

}  // namespace likeness
