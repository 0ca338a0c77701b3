#include "likeness/train/texel_weights.h"

#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <span>

#include "likeness/base/error.h"

namespace likeness {

namespace {

constexpr float kLeastPixels = 0.02f;  // a texel's area in the image, px; less counts as this
constexpr float kMostPixels = 100;

// Twice the area of a triangle, signed.
double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

const std::vector<std::string>& TexelWeightingNames() {
  static const std::vector<std::string> names = {"all", "seen", "pixels"};
  return names;
}

TexelWeighting ParseTexelWeighting(const std::string& name) {
  const std::vector<std::string>& names = TexelWeightingNames();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) throw Error("--texels is '{}'; known are {}", name, fmt::join(names, ", "));
  return static_cast<TexelWeighting>(found - names.begin());
}

TexelWeights::TexelWeights(MeshTopology topology, int size, TexelWeighting weighting)
    : topology_(std::move(topology)), weighting_(weighting) {
  if (weighting != TexelWeighting::kPixels) return;
  for (const TexelMap::Texel& texel : MapTexels(topology_, size).texels) triangle_.push_back(texel.triangle);
  for (const Eigen::Vector3i& corners : topology_.triangle_uvs) {
    const Eigen::Vector2d a = topology_.uvs[corners[0]].cast<double>(), b = topology_.uvs[corners[1]].cast<double>(),
                          c = topology_.uvs[corners[2]].cast<double>();
    texels_.push_back(static_cast<float>(std::abs(Cross(b - a, c - a)) / 2 * size * size));
  }
}

std::vector<float> TexelWeights::PixelsOfTriangles(const Camera& camera, const RigidTransform& world_from_head,
                                                   const Vertices& vertices_in_head) const {
  const RigidTransform cam_from_head = camera.cam_from_world * world_from_head;
  std::vector<Eigen::Vector2d> pixels(vertices_in_head.rows());
  std::vector<bool> in_front(pixels.size());
  for (Eigen::Index v = 0; v < vertices_in_head.rows(); ++v) {
    const Eigen::Vector3d point = cam_from_head * Eigen::Vector3d(vertices_in_head.row(v).transpose().cast<double>());
    in_front[v] = point.z() > 0;
    pixels[v] = (camera.intrinsics * point).hnormalized();
  }
  std::vector<float> areas;
  for (size_t t = 0; t < topology_.triangles.size(); ++t) {
    const Eigen::Vector3i& corners = topology_.triangles[t];
    const bool visible = in_front[corners[0]] && in_front[corners[1]] && in_front[corners[2]] && texels_[t] > 0;
    const Eigen::Vector2d &a = pixels[corners[0]], &b = pixels[corners[1]], &c = pixels[corners[2]];
    const double area = visible ? std::abs(Cross(b - a, c - a)) / 2 / texels_[t] : 0;
    areas.push_back(std::clamp(static_cast<float>(area), kLeastPixels, kMostPixels));
  }
  return areas;
}

void TexelWeights::Write(const Camera& camera, const RigidTransform& world_from_head, const Vertices& vertices_in_head,
                         const ImageU8& seen, float* weights) const {
  const std::span<const uint8_t> mask = seen.values();
  if (weighting_ == TexelWeighting::kPixels) {
    const std::vector<float> areas = PixelsOfTriangles(camera, world_from_head, vertices_in_head);
    for (size_t i = 0; i < mask.size(); ++i) {
      weights[i] = mask[i] == 0 ? 0 : triangle_[i] < 0 ? kLeastPixels : areas[triangle_[i]];
    }
  } else {
    for (size_t i = 0; i < mask.size(); ++i) weights[i] = mask[i] == 0 ? 0 : 1;
  }
  if (weighting_ == TexelWeighting::kAll) return;
  double sum = 0;
  for (size_t i = 0; i < mask.size(); ++i) sum += weights[i];
  const auto scale = static_cast<float>(sum > 0 ? static_cast<double>(mask.size()) / sum : 0);
  for (size_t i = 0; i < mask.size(); ++i) weights[i] = std::sqrt(scale * weights[i]);
}

}  // namespace likeness
