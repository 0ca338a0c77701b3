#include "likeness/simulate/human/lashes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "likeness/base/random.h"

namespace likeness {
namespace {

constexpr int kSteps = 4;                                // a blade's pieces
constexpr float kRootWidth = 0.18f / Lashes::kCoverage;  // mm

}  // namespace

Lashes::Lashes(std::vector<int> upper_rim, std::vector<int> lower_rim, Side side, const HumanRecipe& recipe)
    : upper_rim_(std::move(upper_rim)), lower_rim_(std::move(lower_rim)) {
  Random random(Hash({recipe.seed, 60, static_cast<uint64_t>(side)}));
  const auto uniform = [&](double a, double b) { return static_cast<float>(random.Uniform(a, b)); };
  const float vigour = static_cast<float>(1.1 - 0.2 * recipe.male - 0.25 * recipe.age);
  for (const bool upper : {true, false}) {
    const int count = upper ? 90 : 55;
    const auto last = static_cast<float>((upper ? upper_rim_ : lower_rim_).size() - 1);
    for (int i = 0; i < count; ++i) {
      // None at the tear duct; longest past the middle.
      const float t = (static_cast<float>(i) + uniform(0.1, 0.9)) / static_cast<float>(count);
      const float from_nose = side == kLeft ? t : 1 - t;
      const float along = 0.12f + 0.82f * from_nose;
      const float longest = upper ? 7.5f : 4.2f;
      const float length = vigour * longest * (0.55f + 0.45f * std::sin(2.6f * along)) * uniform(0.75, 1.05);
      const float outwards = side == kLeft ? 1.0f : -1.0f;
      const float slant = outwards * 0.55f * (along - 0.42f) + uniform(-0.18, 0.18);
      const float place = (side == kLeft ? along : 1 - along) * last;
      lashes_.push_back({upper, place, length, slant, uniform(0.75, 1.15)});
    }
  }
  for (size_t i = 0; i < lashes_.size(); ++i) {
    const int first = topology_.vertex_count;
    for (int s = 0; s < kSteps; ++s) {
      const int a = first + 2 * s, b = a + 1, c = a + 2, d = std::min(a + 3, first + 2 * kSteps);
      topology_.triangles.emplace_back(a, b, c);
      if (d != c) topology_.triangles.emplace_back(b, d, c);
    }
    topology_.vertex_count += 2 * kSteps + 1;
  }
  topology_.uvs = {{0.5f, 0.5f}};
  topology_.triangle_uvs.assign(topology_.triangles.size(), Eigen::Vector3i::Zero());
}

Vertices Lashes::Positions(const Vertices& fine, const EyeFit& eye) const {
  Vertices points(topology_.vertex_count, 3);
  Eigen::Index next = 0;
  for (const Lash& lash : lashes_) {
    const std::vector<int>& rim = lash.upper ? upper_rim_ : lower_rim_;
    const int i = std::min(static_cast<int>(lash.place), static_cast<int>(rim.size()) - 2);
    const float t = lash.place - static_cast<float>(i);
    const Eigen::Vector3f a = fine.row(rim[i]), b = fine.row(rim[i + 1]);
    const Eigen::Vector3f root = a + t * (b - a);
    const Eigen::Vector3f along = (b - a).stableNormalized();
    const Eigen::Vector3f out = (root - eye.centre).stableNormalized();
    // Away from the opening: up for the upper lid.
    const Eigen::Vector3f away = (lash.upper ? out.cross(along) : along.cross(out)).stableNormalized();
    const Eigen::Vector3f start =
        (out * (lash.upper ? 1.0f : 0.9f) - away * (lash.upper ? 0.35f : 0.1f) + along * lash.slant).normalized();
    // A parabola: leaves along `start` and bends away. The blade lies across the line of sight from the front.
    for (int s = 0; s <= kSteps; ++s) {
      const float u = static_cast<float>(s) / kSteps;
      const Eigen::Vector3f centre =
          root + lash.length * (u * start * (1 - 0.25f * u) + u * u * away * 0.75f * lash.lift);
      if (s == kSteps) {
        points.row(next++) = centre;
        break;
      }
      const float width = kRootWidth * (1 - 0.65f * u);
      points.row(next++) = centre - 0.5f * width * along;
      points.row(next++) = centre + 0.5f * width * along;
    }
  }
  return points;
}

}  // namespace likeness
