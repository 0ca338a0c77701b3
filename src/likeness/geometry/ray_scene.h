// Rays against triangles, on Embree. This header and its source are the only places that know Embree's interface.

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "likeness/geometry/mesh.h"

namespace likeness {

struct Ray {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  Eigen::Vector3f direction = Eigen::Vector3f::UnitZ();  // any length; t counts in units of it
  float t_min = 0;
  float t_max = 1e30f;
};

struct RayHit {
  int mesh = -1;  // as Add() numbered it; -1 for a miss
  int triangle = -1;
  float t = 0;
  float b1 = 0, b2 = 0;  // barycentric weights of the triangle's second and third corner
};

// Sixteen rays lane by lane, the form in which they are traced fastest. Directions as in Ray.
struct RayPacket16 {
  alignas(64) float origin_x[16];
  alignas(64) float origin_y[16];
  alignas(64) float origin_z[16];
  alignas(64) float direction_x[16];
  alignas(64) float direction_y[16];
  alignas(64) float direction_z[16];
  alignas(64) float t_min[16];
  alignas(64) float t_max[16];
};

// A set of meshes with a bounding-volume hierarchy. Build once, then query from any number of threads.
class RayScene {
 public:
  RayScene();
  ~RayScene();
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;

  // Copies the geometry and returns the mesh's number, from 0. With `one_sided`, triangles seen from behind
  // (clockwise) let rays pass.
  int Add(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles, bool one_sided = false);
  void Build();

  RayHit Intersect(const Ray& ray) const;

  // Up to sixteen coherent rays at once; hits[i] is ray i's.
  void Intersect16(std::span<const Ray> rays, std::span<RayHit> hits) const;

  // Whether anything lies on the ray between t_min and t_max.
  bool Occluded(const Ray& ray) const;

  // Up to sixteen coherent rays at once; bit i of the result is set when ray i is occluded.
  uint32_t Occluded16(std::span<const Ray> rays) const;

  // The same for the lanes whose bits are set in `active`; the others need no values.
  uint32_t Occluded16(const RayPacket16& rays, uint32_t active) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace likeness
