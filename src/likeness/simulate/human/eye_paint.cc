#include "likeness/simulate/human/eye_paint.h"

#include <algorithm>
#include <cmath>

#include "likeness/base/parallel.h"
#include "likeness/base/random.h"
#include "likeness/simulate/human/eye.h"
#include "likeness/simulate/human/noise.h"
#include "likeness/simulate/human/pigment.h"

namespace likeness {
namespace {

using Eigen::Vector3f;

constexpr float kPupil = 0.36f;  // of the iris' radius

// Linear colour at a distance from the iris' centre, 1 at the limbus; `direction` is the unit vector towards it.
Vector3f IrisColour(float radius, const Eigen::Vector2f& direction, float melanin, uint32_t seed) {
  // A point on a cylinder gives noise that closes around the circle.
  const auto around = [&](float across, float along, uint32_t s) {
    return FractalNoise(Vector3f(direction.x() * across, direction.y() * across, radius * along), 3, seed + s);
  };
  const float fibres = around(16, 1.2f, 0), coarse = around(5, 2.5f, 10);
  const Vector3f blue(0.105f, 0.175f, 0.24f), green(0.125f, 0.150f, 0.075f), hazel(0.150f, 0.085f, 0.030f),
      brown(0.055f, 0.024f, 0.010f);
  const auto mix = [](const Vector3f& a, const Vector3f& b, float t) -> Vector3f { return a + t * (b - a); };
  // More melanin towards the pupil.
  const float ring = SmoothStep(0.72f + 0.12f * coarse, 0.45f, radius);
  const float amount = std::clamp(melanin + 0.28f * ring * (1 - melanin) + 0.08f * coarse, 0.0f, 1.0f);
  Vector3f colour = amount < 0.4f   ? mix(blue, green, amount / 0.4f)
                    : amount < 0.7f ? mix(green, hazel, (amount - 0.4f) / 0.3f)
                                    : mix(hazel, brown, (amount - 0.7f) / 0.3f);
  colour *= 1 + 0.75f * fibres + 0.25f * coarse;
  // The collarette's pale ruff, and the dark ring at the limbus.
  colour *= 1 + 0.35f * SmoothStep(0.09f, 0, std::abs(radius - 0.52f - 0.04f * coarse));
  colour *= 1 - 0.7f * SmoothStep(0.84f, 1.0f, radius);
  const float pupil = SmoothStep(kPupil + 0.02f + 0.01f * coarse, kPupil - 0.015f, radius);
  return mix(colour.cwiseMax(0.004f), Vector3f(0.004f, 0.004f, 0.004f), pupil);
}

Vector3f ScleraColour(const Eigen::Vector2f& position, float beyond, const HumanRecipe& recipe, uint32_t seed) {
  // `beyond`: 0 at the limbus, 1 at the edge of the texture.
  const float tint = FractalNoise(Vector3f(position.x() * 6, position.y() * 6, 1), 3, seed + 20);
  Vector3f colour(0.70f, 0.62f, 0.56f);
  colour += Vector3f(0.02f, -0.01f, -0.05f) * (0.6f + 0.8f * static_cast<float>(recipe.age) + tint) * 0.8f;
  const float red = SmoothStep(0.1f, 0.6f, beyond);
  colour = colour.cwiseProduct(Vector3f(1, 1 - 0.20f * red, 1 - 0.20f * red));
  // Thin, branching vessels that grow towards the corners: zero lines of warped noise.
  const Vector3f warped(position.x() * 9 + 0.9f * tint, position.y() * 9, 5);
  const float line = std::abs(FractalNoise(warped, 3, seed + 30));
  const float fine = std::abs(FractalNoise(warped * 2.3f, 2, seed + 40));
  const float vessels =
      std::max(SmoothStep(0.035f, 0, line), 0.6f * SmoothStep(0.05f, 0, fine)) * SmoothStep(0.02f, 0.35f, beyond);
  return colour.cwiseProduct(Vector3f(1 - 0.06f * vessels, 1 - 0.38f * vessels, 1 - 0.36f * vessels));
}

}  // namespace

Material PaintEyeball(const HumanRecipe& recipe, int side) {
  const int size = std::clamp(recipe.texture_size / 2, 256, 1024);
  const auto seed = static_cast<uint32_t>(Hash({recipe.seed, 50, static_cast<uint64_t>(side)}));
  Material material;
  material.albedo = ImageU8(size, size, 3);
  material.roughness = 0.45f;
  material.specular_f0 = 0.02f;
  material.scatter = {0.25f, 0.2f, 0.18f};
  ParallelFor(size, [&](int64_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < size; ++x) {
      const Eigen::Vector2f position((static_cast<float>(x) + 0.5f) / static_cast<float>(size) - 0.5f,
                                     0.5f - (static_cast<float>(y) + 0.5f) / static_cast<float>(size));
      const float radius = position.norm() / kIrisInUv;
      const Eigen::Vector2f direction = position.stableNormalized();
      const Vector3f sclera = ScleraColour(position, std::clamp(radius - 1, 0.0f, 1.0f), recipe, seed);
      Vector3f colour = sclera;
      if (radius < 1.1f) {
        const Vector3f iris = IrisColour(std::min(radius, 1.0f), direction, static_cast<float>(recipe.iris), seed);
        // The border is soft, as the sclera thins into the cornea.
        colour = iris + SmoothStep(0.95f, 1.06f, radius) * (sclera - iris);
      }
      for (int c = 0; c < 3; ++c) material.albedo.at(x, y)[c] = EncodeSrgb(colour[c]);
    }
  });
  return material;
}

Material CorneaMaterial() {
  Material material;
  material.albedo = ImageU8(1, 1, 3, 0);
  material.transparent = true;
  material.coat = 1;
  material.coat_roughness = 0.06f;
  material.casts_shadow = false;
  return material;
}

}  // namespace likeness
