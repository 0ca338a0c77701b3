// Flips, exchanged colours and shifts of a known picture.

#include "likeness/validate/texture_match.h"

#include <gtest/gtest.h>

#include <cmath>

namespace likeness {
namespace {

// A picture without symmetry, displaced by (right, down) texels; a corner of it is not seen.
ImageU8 Picture(double right, double down) {
  ImageU8 picture(96, 96, 3);
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 96; ++x) {
      if (x + y < 30) continue;
      const double u = x - right, v = y - down;
      const double wave = std::sin(0.31 * u + 0.001 * u * v) + std::cos(0.27 * v + 0.05 * u);
      for (int c = 0; c < 3; ++c) picture.at(x, y)[c] = static_cast<uint8_t>(120 + 30 * wave + 30 * (1 - c));
    }
  }
  return picture;
}

TEST(TextureMatchTest, FindsFlips) {
  for (const TextureFlip flip :
       {TextureFlip::kNone, TextureFlip::kVertical, TextureFlip::kHorizontal, TextureFlip::kBoth}) {
    const TextureMatch match = MatchTextures(Flipped(Picture(0, 0), flip), Picture(0, 0));
    EXPECT_EQ(match.flip, flip);
    EXPECT_GT(match.correlation, 0.99);
    EXPECT_NEAR(match.right, 0, 0.02);
    EXPECT_NEAR(match.down, 0, 0.02);
    EXPECT_FALSE(match.swapped);
  }
}

TEST(TextureMatchTest, MeasuresShifts) {
  for (const double right : {-1.5, -0.5, 0.0, 0.25, 0.5, 1.0}) {
    for (const double down : {-0.5, 0.0, 1.2}) {
      const TextureMatch match = MatchTextures(Picture(right, down), Picture(0, 0));
      EXPECT_EQ(match.flip, TextureFlip::kNone);
      EXPECT_NEAR(match.right, right, 0.1);
      EXPECT_NEAR(match.down, down, 0.1);
    }
  }
}

TEST(TextureMatchTest, FindsExchangedColours) {
  ImageU8 swapped = Picture(0, 0);
  for (size_t i = 0; i < swapped.values().size(); i += 3) std::swap(swapped.values()[i], swapped.values()[i + 2]);
  EXPECT_TRUE(MatchTextures(swapped, Picture(0, 0)).swapped);
}

TEST(TextureMatchTest, NothingInCommonIsNoMatch) {
  EXPECT_EQ(MatchTextures(ImageU8(96, 96, 3), Picture(0, 0)).correlation, 0);
}

}  // namespace
}  // namespace likeness
