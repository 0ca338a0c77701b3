#include "likeness/simulate/procedural_skin.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "likeness/base/parallel.h"
#include "likeness/base/random.h"
#include "likeness/simulate/procedural_shape.h"

namespace likeness {
namespace {

using Colour = Eigen::Array3d;

double SmoothStep(double a, double b, double x) {
  const double t = std::clamp((x - a) / (b - a), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// Value noise in -1 ... 1; `period` lattice cells across make it meet itself at u = 0 and 1.
double Noise(double u, double v, int period, uint64_t seed) {
  const double x = u * period, y = v * period;
  const double x_floor = std::floor(x), y_floor = std::floor(y);
  const uint64_t lattice = Hash({seed, static_cast<uint64_t>(period)});
  const auto corner = [&](double cx, double cy) {
    const auto column = static_cast<int64_t>(cx) % period;
    const auto cell = static_cast<uint64_t>((column + period) % period) << 32 | static_cast<uint64_t>(cy);
    const uint64_t hash = Hash({lattice, cell});
    return static_cast<double>(hash >> 11) * 0x1p-52 - 1;
  };
  const double fx = SmoothStep(0, 1, x - x_floor), fy = SmoothStep(0, 1, y - y_floor);
  const double low = corner(x_floor, y_floor) * (1 - fx) + corner(x_floor + 1, y_floor) * fx;
  const double high = corner(x_floor, y_floor + 1) * (1 - fx) + corner(x_floor + 1, y_floor + 1) * fx;
  return low * (1 - fy) + high * fy;
}

Colour Mix(const Colour& a, const Colour& b, double share) { return a + std::clamp(share, 0.0, 1.0) * (b - a); }

// Angle from the line of sight, radians, to colour. Iris and pupil are those of a 12 mm eyeball.
Colour EyeColour(double angle, double around, uint64_t seed) {
  const double fibres = Noise(around, angle * 0.5, 48, seed);
  const Colour iris = Mix({0.30, 0.42, 0.50}, {0.55, 0.50, 0.36}, 0.5 + 0.5 * fibres);
  const Colour sclera = Mix({0.90, 0.87, 0.84}, {0.86, 0.62, 0.56}, 0.25 * SmoothStep(0.8, 1.6, angle));
  Colour colour = Mix({0.02, 0.02, 0.02}, iris, SmoothStep(0.17, 0.21, angle));
  colour = Mix(colour, iris * 0.45, SmoothStep(0.40, 0.48, angle));
  return Mix(colour, sclera, SmoothStep(0.46, 0.53, angle));
}

Colour SkinColour(double s, double t, uint64_t seed) {
  const double coarse = Noise(s, t, 6, seed), medium = Noise(s, t, 22, seed + 1);
  const double fine = Noise(s, t, 90, seed + 2), finest = Noise(s, t, 260, seed + 3);
  Colour colour(0.80, 0.62, 0.53);
  colour = Mix(colour, {0.78, 0.50, 0.43}, 0.35 + 0.30 * coarse + 0.18 * medium);
  colour *= 1 + 0.035 * medium + 0.045 * fine + 0.05 * finest;
  if (Noise(s, t, 70, seed + 4) > 0.83) colour *= 0.84;  // freckles
  // Lips around the mouth, its inside within.
  const double p = kMouthRectangle.P(s), q = kMouthRectangle.Q(t);
  const double across = std::abs(q) - 0.25 * (1 - p * p);
  const double lips = (1 - SmoothStep(1.25, 1.45, across)) * (1 - SmoothStep(0.95, 1.1, std::abs(p)));
  colour = Mix(colour, Colour(0.68, 0.33, 0.32) * (1 + 0.06 * fine), 0.85 * lips);
  if (std::abs(p) < 1 && std::abs(q) < 1) {
    const double deep = SmoothStep(0.0, 0.25, 1 - std::max(std::abs(p), std::abs(q)));
    colour = Mix(colour, Colour(0.50, 0.18, 0.18) * (1 + 0.1 * medium), deep);
  }
  for (const GridRectangle& eye : {kLeftEyeRectangle, kRightEyeRectangle}) {
    const double ep = eye.P(s), eq = eye.Q(t);
    const double brow_height = eq - 4.0 + 0.45 * ep * ep;
    const double brow = (1 - SmoothStep(0.45, 0.8, std::abs(brow_height))) * (1 - SmoothStep(1.0, 1.4, std::abs(ep)));
    colour = Mix(colour, {0.24, 0.16, 0.12}, brow * (0.75 + 0.25 * finest));
    if (std::abs(ep) < 1 && std::abs(eq) < 1) {
      const double x = 12.5 * ep, y = 4.7 * eq * (1 - 0.92 * ep * ep);
      const double angle = std::asin(std::min(std::hypot(x, y) / kEyeballRadiusMm, 1.0));
      const double around = std::atan2(y, x) / (2 * std::numbers::pi) + 0.5;
      colour = EyeColour(angle, around, seed + 5);
    } else if (std::abs(ep) < 1.12 && std::abs(eq) < 1.25) {
      colour *= 0.72;  // lash line
    }
  }
  return colour;
}

template <typename F>
ImageU8 Paint(int size, const F& colour_at) {
  ImageU8 image(size, size, 3);
  ParallelFor(size, [&](int64_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < size; ++x) {
      const Colour colour = colour_at((x + 0.5) / size, 1 - (y + 0.5) / size);
      for (int c = 0; c < 3; ++c) {
        image.at(x, y)[c] = static_cast<uint8_t>(std::lround(255 * std::clamp(colour[c], 0.0, 1.0)));
      }
    }
  });
  return image;
}

}  // namespace

ImageU8 PaintProceduralSkin(int size, uint64_t seed) {
  return Paint(size, [&](double u, double v) { return SkinColour(u, v, seed); });
}

ImageU8 PaintProceduralEye(int size, uint64_t seed) {
  return Paint(size, [&](double u, double v) { return EyeColour((1 - v) * std::numbers::pi, u, seed + 5); });
}

}  // namespace likeness
