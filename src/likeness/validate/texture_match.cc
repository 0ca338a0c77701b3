#include "likeness/validate/texture_match.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "likeness/image/foreground.h"

namespace likeness {
namespace {

bool IsSeen(const ImageU8& texture, int x, int y) {
  const uint8_t* p = texture.at(x, y);
  return (p[0] | p[1] | p[2]) != 0;
}

ImageU8 SeenMask(const ImageU8& texture) {
  ImageU8 mask(texture.width(), texture.height(), 1);
  for (int y = 0; y < texture.height(); ++y) {
    for (int x = 0; x < texture.width(); ++x) *mask.at(x, y) = IsSeen(texture, x, y) ? 255 : 0;
  }
  return mask;
}

struct Detail {
  ImageF contrast;
  ImageU8 seen;
};

// Texels near the unseen are left out: there the surroundings are cut off alike in both textures.
Detail DetailOf(const ImageU8& texture) {
  const int size = texture.width(), radius = std::max(3, size / 24);
  const ImageU8 seen = SeenMask(texture);
  Detail detail = {LocalContrast(texture, seen, radius), ImageU8(size, size, 1)};
  for (int y = radius; y < size - radius; ++y) {
    for (int x = radius; x < size - radius; ++x) {
      bool whole = true;
      for (int k = 0; k < 9 && whole; ++k) whole = *seen.at(x + (k % 3 - 1) * radius, y + (k / 3 - 1) * radius) != 0;
      if (whole) *detail.seen.at(x, y) = 255;
    }
  }
  return detail;
}

struct Correlation {
  double value = 0;
  int texels = 0;
};

// Of stored(x + dx, y + dy) with made(x, y).
Correlation Correlate(const Detail& stored, const Detail& made, int dx, int dy) {
  double n = 0, sa = 0, sb = 0, aa = 0, bb = 0, ab = 0;
  const int size = made.seen.width();
  for (int y = std::max(0, -dy); y < size - std::max(0, dy); ++y) {
    for (int x = std::max(0, -dx); x < size - std::max(0, dx); ++x) {
      if (*made.seen.at(x, y) == 0 || *stored.seen.at(x + dx, y + dy) == 0) continue;
      const double a = *stored.contrast.at(x + dx, y + dy), b = *made.contrast.at(x, y);
      n += 1, sa += a, sb += b, aa += a * a, bb += b * b, ab += a * b;
    }
  }
  Correlation correlation;
  correlation.texels = static_cast<int>(n);
  const double va = aa - sa * sa / n, vb = bb - sb * sb / n;
  if (n >= 100 && va > 0 && vb > 0) correlation.value = (ab - sa * sb / n) / std::sqrt(va * vb);
  return correlation;
}

// The least-squares displacement of stored(x + dx, ...) against made, from made's gradient (Lucas and Kanade 1981).
Eigen::Vector2d Displacement(const Detail& stored, const Detail& made, int dx, int dy) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  const int size = made.seen.width();
  const auto inside = [&](int x, int y) {
    return x + dx >= 0 && y + dy >= 0 && x + dx < size && y + dy < size && *made.seen.at(x, y) != 0 &&
           *stored.seen.at(x + dx, y + dy) != 0;
  };
  for (int y = 2; y < size - 2; ++y) {
    for (int x = 2; x < size - 2; ++x) {
      bool whole = true;
      for (int k = -2; k <= 2 && whole; ++k) whole = inside(x + k, y) && inside(x, y + k);
      if (!whole) continue;
      // The gradient of both: half a texel is no small step, and the mean of the two takes its middle.
      const auto gradient = [](const ImageF& i, int u, int v) {
        return Eigen::Vector2d((*i.at(u + 1, v) - *i.at(u - 1, v)) / 2, (*i.at(u, v + 1) - *i.at(u, v - 1)) / 2);
      };
      const Eigen::Vector2d g = (gradient(made.contrast, x, y) + gradient(stored.contrast, x + dx, y + dy)) / 2;
      const double difference = *made.contrast.at(x, y) - *stored.contrast.at(x + dx, y + dy);
      normal += g * g.transpose();
      right += g * difference;
    }
  }
  if (!(normal.determinant() > 1e-12)) return Eigen::Vector2d::Zero();
  return normal.inverse() * right;
}

}  // namespace

std::string ToString(TextureFlip flip) {
  switch (flip) {
    case TextureFlip::kNone:
      return "not at all";
    case TextureFlip::kVertical:
      return "top to bottom";
    case TextureFlip::kHorizontal:
      return "left to right";
    case TextureFlip::kBoth:
      return "by half a turn";
  }
  return "";
}

ImageU8 Flipped(const ImageU8& image, TextureFlip flip) {
  ImageU8 flipped(image.width(), image.height(), image.channels());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const bool down = flip == TextureFlip::kVertical || flip == TextureFlip::kBoth;
      const bool across = flip == TextureFlip::kHorizontal || flip == TextureFlip::kBoth;
      const uint8_t* from = image.at(across ? image.width() - 1 - x : x, down ? image.height() - 1 - y : y);
      std::copy_n(from, image.channels(), flipped.at(x, y));
    }
  }
  return flipped;
}

TextureMatch MatchTextures(const ImageU8& stored, const ImageU8& made) {
  LIKENESS_CHECK(stored.SameShape(made) && stored.channels() == 3);
  const Detail target = DetailOf(made);
  TextureMatch match;
  match.correlation = -2;
  Detail best;
  int best_x = 0, best_y = 0;
  for (const TextureFlip flip :
       {TextureFlip::kNone, TextureFlip::kVertical, TextureFlip::kHorizontal, TextureFlip::kBoth}) {
    const Detail detail = DetailOf(Flipped(stored, flip));
    Correlation here;
    // A shift must not make a flip look better.
    for (const int dy : {-2, 0, 2}) {
      for (const int dx : {-2, 0, 2}) {
        const Correlation there = Correlate(detail, target, dx, dy);
        if (flip == TextureFlip::kNone && dx == 0 && dy == 0) match.correlation_as_stored = there.value;
        if (there.texels > 0 && (here.texels == 0 || there.value > here.value)) here = there;
      }
    }
    if (here.value <= match.correlation + 0.02) continue;
    match.correlation = here.value, match.texels = here.texels, match.flip = flip;
    best = detail;
  }
  if (match.texels < 100) {
    match.correlation = 0;
    return match;
  }
  // Coarse to fine: whole texels by correlation, the rest by gradients.
  match.correlation = -2;
  for (int dy = -2; dy <= 2; ++dy) {
    for (int dx = -2; dx <= 2; ++dx) {
      const Correlation there = Correlate(best, target, dx, dy);
      if (there.value <= match.correlation + 1e-3) continue;
      match.correlation = there.value;
      best_x = dx, best_y = dy;
    }
  }
  const Eigen::Vector2d rest = Displacement(best, target, best_x, best_y).cwiseMax(-1).cwiseMin(1);
  match.right = best_x + rest.x();
  match.down = best_y + rest.y();

  const ImageU8 upright = Flipped(stored, match.flip);
  double straight = 0, crossed = 0;
  for (size_t i = 0; i + 2 < made.values().size(); i += 3) {
    const uint8_t* a = &upright.values()[i];
    const uint8_t* b = &made.values()[i];
    if ((a[0] | a[1] | a[2]) == 0 || (b[0] | b[1] | b[2]) == 0) continue;
    straight += std::abs(a[0] - b[0]) + std::abs(a[2] - b[2]);
    crossed += std::abs(a[0] - b[2]) + std::abs(a[2] - b[0]);
  }
  match.swapped = crossed < 0.5 * straight;
  return match;
}

}  // namespace likeness
