#include "likeness/simulate/human/brows.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "likeness/base/random.h"

namespace likeness {
namespace {

using Eigen::Vector2f;

// The drawing spans x in [-kHalfWidth, kHalfWidth] and y in [kBottom, kTop], mm.
constexpr float kHalfWidth = 72, kBottom = 2, kTop = 40;
constexpr float kPixel = 0.12f;  // mm

// The middle line of the left brow from the nose outwards, t in [0, 1].
Vector2f BrowLine(float t) {
  const Vector2f p0(10.5f, 14.5f), p1(27, 21.5f), p2(45, 25.5f), p3(61, 13);
  const float s = 1 - t;
  return s * s * s * p0 + 3 * s * s * t * p1 + 3 * s * t * t * p2 + t * t * t * p3;
}

}  // namespace

BrowDrawing::BrowDrawing(const HumanRecipe& recipe)
    : coverage_(static_cast<int>(2 * kHalfWidth / kPixel), static_cast<int>((kTop - kBottom) / kPixel), 1) {
  const float fullness = static_cast<float>(recipe.brows);
  for (const float side : {1.0f, -1.0f}) {
    Random random(Hash({recipe.seed, 40, side > 0 ? 0u : 1u}));
    const auto uniform = [&](double a, double b) { return static_cast<float>(random.Uniform(a, b)); };
    const int hairs = static_cast<int>(330 + 470 * fullness);
    for (int i = 0; i < hairs; ++i) {
      const float t = uniform(0, 1);
      // Half the brow's height: full near the nose, thin at the tail.
      const float half = (1.8f + 2.5f * fullness) * (1 - 0.72f * t * t) * std::min(1.0f, 0.55f + 3 * t);
      const float across = std::clamp(0.55f * static_cast<float>(random.Normal()), -1.0f, 1.0f);
      const Vector2f along = (BrowLine(std::min(t + 0.01f, 1.0f)) - BrowLine(std::max(t - 0.01f, 0.0f))).normalized();
      const Vector2f root = BrowLine(t) + across * half * Vector2f(-along.y(), along.x());
      // Hairs stand up near the nose and lie along the brow farther out, leaning towards its middle line.
      const float upright = std::numbers::pi_v<float> / 2 * std::max(0.0f, 0.85f - 2.4f * t);
      const float angle = std::atan2(along.y(), along.x()) + upright - 0.4f * across + uniform(-0.22, 0.22);
      const float length = uniform(3.5, 7) * (1 - 0.35f * t);
      const float width = uniform(0.18, 0.34);
      DrawHair({side * root.x(), root.y()}, side > 0 ? angle : std::numbers::pi_v<float> - angle,
               -side * uniform(0.02, 0.09), length, width);
    }
  }
}

void BrowDrawing::DrawHair(Vector2f root, float angle, float curl, float length, float width) {
  const int steps = static_cast<int>(length / (0.8f * kPixel));
  Vector2f point = root;
  for (int i = 0; i < steps; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(steps);
    const float radius = std::max(0.5f * width * (1 - t), 0.04f) / kPixel;
    const float strength = 0.88f * (1 - 0.5f * t);
    const float cx = (point.x() + kHalfWidth) / kPixel, cy = (kTop - point.y()) / kPixel;
    for (int y = static_cast<int>(cy - radius - 1); y <= static_cast<int>(cy + radius + 1); ++y) {
      for (int x = static_cast<int>(cx - radius - 1); x <= static_cast<int>(cx + radius + 1); ++x) {
        if (x < 0 || y < 0 || x >= coverage_.width() || y >= coverage_.height()) continue;
        const float distance = std::hypot(static_cast<float>(x) + 0.5f - cx, static_cast<float>(y) + 0.5f - cy);
        float& value = *coverage_.at(x, y);
        value = std::max(value, strength * std::clamp(radius + 0.5f - distance, 0.0f, 1.0f));
      }
    }
    point += 0.8f * kPixel * Vector2f(std::cos(angle), std::sin(angle));
    angle += curl * 0.8f * kPixel;
  }
}

float BrowDrawing::Coverage(const Vector2f& frontal) const {
  // The mean over about a texel of the face.
  constexpr int kReach = 1;
  const int cx = static_cast<int>(std::floor((frontal.x() + kHalfWidth) / kPixel));
  const int cy = static_cast<int>(std::floor((kTop - frontal.y()) / kPixel));
  if (cx < kReach || cy < kReach || cx >= coverage_.width() - kReach || cy >= coverage_.height() - kReach) return 0;
  float sum = 0;
  for (int y = -kReach; y <= kReach; ++y) {
    for (int x = -kReach; x <= kReach; ++x) sum += *coverage_.at(cx + x, cy + y);
  }
  return sum / ((2 * kReach + 1) * (2 * kReach + 1));
}

}  // namespace likeness
