// A small head-like scene with a known texture, and a plain renderer of it, for tests.

#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "likeness/capture/capture.h"
#include "likeness/geometry/camera.h"
#include "likeness/geometry/mesh.h"
#include "likeness/geometry/ray_scene.h"
#include "likeness/image/image.h"

namespace likeness {

// A ball with lobes that hide each other. One chart; its seam and poles have several uvs a vertex.
struct TestHead {
  static constexpr int kAround = 36, kDown = 24;
  MeshTopology topology;
  Vertices vertices;

  explicit TestHead(double lobes_mm = 25) {
    vertices.resize(kAround * (kDown + 1), 3);
    for (int j = 0; j <= kDown; ++j) {
      for (int i = 0; i < kAround; ++i) {
        const double phi = 2 * std::numbers::pi * i / kAround, theta = std::numbers::pi * j / kDown;
        const double radius = 80 + lobes_mm * std::sin(theta) * std::cos(5 * phi) * std::cos(3 * theta);
        vertices.row(j * kAround + i) << static_cast<float>(radius * std::sin(theta) * std::sin(phi)),
            static_cast<float>(radius * std::cos(theta)), static_cast<float>(radius * std::sin(theta) * std::cos(phi));
      }
      for (int i = 0; i <= kAround; ++i) {
        topology.uvs.emplace_back(0.04f + 0.92f * static_cast<float>(i) / kAround,
                                  0.96f - 0.92f * static_cast<float>(j) / kDown);
      }
    }
    topology.vertex_count = static_cast<int>(vertices.rows());
    const auto vertex = [](int i, int j) { return j * kAround + i % kAround; };
    const auto uv = [](int i, int j) { return j * (kAround + 1) + i; };
    for (int j = 0; j < kDown; ++j) {
      for (int i = 0; i < kAround; ++i) {
        topology.triangles.emplace_back(vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1));
        topology.triangle_uvs.emplace_back(uv(i, j), uv(i, j + 1), uv(i + 1, j + 1));
        topology.triangles.emplace_back(vertex(i, j), vertex(i + 1, j + 1), vertex(i + 1, j));
        topology.triangle_uvs.emplace_back(uv(i, j), uv(i + 1, j + 1), uv(i + 1, j));
      }
    }
  }
};

// The texture as a function of u and v, 0 ... 255; it changes by at most kTextureSlope a unit of uv.
inline constexpr double kTextureSlope = 60 * 9;
inline Eigen::Vector3d TestTexture(const Eigen::Vector2d& uv, double phase = 0) {
  Eigen::Vector3d colour;
  for (int c = 0; c < 3; ++c) colour[c] = 130 + 60 * std::sin((5 + 2 * c) * uv.x() + phase) * std::cos(6 * uv.y() + c);
  return colour;
}

inline Eigen::Vector2d UvAt(const MeshTopology& topology, int triangle, double b1, double b2) {
  const Eigen::Vector3i& corners = topology.triangle_uvs[static_cast<size_t>(triangle)];
  const auto uv = [&](int corner) -> Eigen::Vector2d {
    return topology.uvs[static_cast<size_t>(corners[corner])].cast<double>();
  };
  return (1 - b1 - b2) * uv(0) + b1 * uv(1) + b2 * uv(2);
}

struct TestPicture {
  ImageU8 image;                     // the texture at each pixel's centre; background 20 20 20
  ImageU8 mask;                      // 255 = head
  std::vector<Eigen::Vector2d> uvs;  // of each pixel's centre; -1 for background
};

inline TestPicture DrawTestHead(const TestHead& head, const Camera& camera, const RigidTransform& world_from_head,
                                double phase = 0) {
  RayScene scene;
  scene.Add(head.vertices, head.topology.triangles);
  scene.Build();
  const RigidTransform head_from_world = world_from_head.Inverse();
  TestPicture picture = {ImageU8(camera.width, camera.height, 3, 20), ImageU8(camera.width, camera.height, 1),
                         std::vector<Eigen::Vector2d>(static_cast<size_t>(camera.width) * camera.height, {-1, -1})};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      Ray ray;
      ray.origin = (head_from_world * camera.CentreInWorld()).cast<float>();
      ray.direction = (head_from_world.rotation * camera.RayInWorld({x + 0.5, y + 0.5})).cast<float>();
      const RayHit hit = scene.Intersect(ray);
      if (hit.mesh < 0) continue;
      const Eigen::Vector2d uv = UvAt(head.topology, hit.triangle, hit.b1, hit.b2);
      const Eigen::Vector3d colour = TestTexture(uv, phase);
      for (int c = 0; c < 3; ++c) picture.image.at(x, y)[c] = static_cast<uint8_t>(std::lround(colour[c]));
      *picture.mask.at(x, y) = 255;
      picture.uvs[static_cast<size_t>(y) * camera.width + x] = uv;
    }
  }
  return picture;
}

inline RigidTransform TestPose() { return {RotationFromYawPitchRoll(0.3, -0.2, 0.1), {1500, -200, 700}}; }

// Cameras a metre from the head of TestPose() that fill the picture with it.
inline std::vector<Camera> TestCameras(int count, int width, int height) {
  std::vector<Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d target = TestPose().translation;
    const double turn = 0.8 * (i - 0.5 * (count - 1));
    const Eigen::Vector3d centre = target + 1000 * Eigen::Vector3d(std::sin(turn), 0.3 * i - 0.2, std::cos(turn));
    cameras.push_back(LookAt(centre, target, {0, 1, 0}, 4.2 * std::min(width, height), width, height));
    cameras.back().name = "cam" + std::to_string(i);
  }
  return cameras;
}

}  // namespace likeness
