#include "likeness/image/draw.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "likeness/base/random.h"
#include "likeness/image/panels.h"
#include "likeness/image/resize.h"

namespace likeness {
namespace {

constexpr Colour kWhite = {255, 255, 255};

double Sum(const ImageU8& image) { return std::accumulate(image.values().begin(), image.values().end(), 0.0); }

ImageU8 RandomImage(int width, int height, int channels) {
  Random random(3);
  ImageU8 image(width, height, channels);
  for (uint8_t& value : image.values()) value = static_cast<uint8_t>(random.Below(256));
  return image;
}

TEST(DrawTest, LineHasTheAreaOfItsLengthTimesItsWidth) {
  for (const float width : {1.0f, 3.0f}) {
    ImageU8 picture(100, 100, 3);
    DrawLine(&picture, {10, 20}, {70, 65}, kWhite, width);  // 75 long
    const double area = Sum(picture) / (3 * 255), caps = M_PI * width * width / 4;
    EXPECT_NEAR(area, 75 * width + caps, 0.02 * 75 * width + 1);
  }
}

TEST(DrawTest, LineCoversItsPixelsOnly) {
  ImageU8 picture(8, 5, 3);
  DrawLine(&picture, {0, 2.5f}, {8, 2.5f}, {10, 20, 30}, 1, 0.5f);
  for (int x = 0; x < 8; ++x) {
    EXPECT_EQ(picture.at(x, 2)[1], 10);
    EXPECT_EQ(picture.at(x, 1)[1], 0);
    EXPECT_EQ(picture.at(x, 3)[1], 0);
  }
}

TEST(DrawTest, NothingIsDrawnOutside) {
  ImageU8 picture(10, 10, 3);
  DrawLine(&picture, {-1e30f, 5}, {1e30f, 5}, kWhite);
  DrawLine(&picture, {-50, -50}, {-20, -70}, kWhite);
  DrawLine(&picture, {std::numeric_limits<float>::quiet_NaN(), 0}, {5, 5}, kWhite);
  DrawWords(&picture, -100, -100, "far away", kWhite, 3);
  Blit(&picture, RandomImage(4, 4, 3), 30, -30);
  FillRectangle(&picture, 12, 12, 5, 5, kWhite);
  EXPECT_EQ(Sum(picture), 0);
  Blit(&picture, ImageU8(100, 100, 1, 7), -50, -50);
  EXPECT_EQ(Sum(picture), 300 * 7);
}

TEST(DrawTest, RectangleOutline) {
  ImageU8 picture(10, 10, 3);
  DrawRectangle(&picture, 2, 3, 5, 4, kWhite);
  EXPECT_EQ(Sum(picture), 3 * 255 * (2 * 5 + 2 * 2));
  EXPECT_EQ(picture.at(6, 6)[0], 255);
  EXPECT_EQ(picture.at(3, 4)[0], 0);
}

TEST(DrawTest, WordsAreReadable) {
  // The font's capital L: an upright and a foot, seven dots high.
  ImageU8 picture(12, 12, 3);
  DrawWords(&picture, 1, 0, "L", kWhite);
  std::string rows;
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 7; ++x) rows += picture.at(x, y)[0] != 0 ? '#' : '.';
    rows += '\n';
  }
  EXPECT_EQ(rows,
            ".#.....\n"
            ".#.....\n"
            ".#.....\n"
            ".#.....\n"
            ".#.....\n"
            ".#.....\n"
            ".####..\n"
            ".......\n"
            ".......\n");
  ImageU8 large(24, 24, 3);
  DrawWords(&large, 2, 0, "L", kWhite, 2);
  EXPECT_EQ(Sum(large), 4 * Sum(picture));
}

TEST(DrawTest, WordsOfAnyBytesAreSafe) {
  std::string bytes;
  for (int i = 255; i > 0; --i) bytes += static_cast<char>(i);
  ImageU8 picture(40, 40, 3);
  DrawWords(&picture, 0, 0, bytes, kWhite);
  EXPECT_GT(Sum(picture), 0);
  EXPECT_EQ(WordsWidth("a\xc3\x97z"), WordsWidth("a?z"));
  EXPECT_EQ(WordsWidth("mm", 3), 3 * WordsWidth("mm"));
  EXPECT_EQ(ShortenWords("short", 1000), "short");
  const std::string cut = ShortenWords("a rather long label", 60);
  EXPECT_LE(WordsWidth(cut), 60);
  EXPECT_TRUE(cut.starts_with("a ra") && cut.ends_with("..")) << cut;
}

TEST(ResizeTest, AreaIsTheMeanOfWhatIsCovered) {
  const ImageU8 image = RandomImage(6, 4, 3);
  const ImageU8 half = ResizeArea(image, 3, 2);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 3; ++x) {
      for (int c = 0; c < 3; ++c) {
        const int sum = image.at(2 * x, 2 * y)[c] + image.at(2 * x + 1, 2 * y)[c] + image.at(2 * x, 2 * y + 1)[c] +
                        image.at(2 * x + 1, 2 * y + 1)[c];
        EXPECT_NEAR(half.at(x, y)[c], sum / 4.0, 0.51);
      }
    }
  }
  ImageU8 step(3, 1, 1);
  *step.at(0, 0) = 90, *step.at(1, 0) = 150, *step.at(2, 0) = 30;
  const ImageU8 two = ResizeArea(step, 2, 1);  // 1.5 old pixels each
  EXPECT_EQ(*two.at(0, 0), (90 + 75) / 1.5);
  EXPECT_EQ(*two.at(1, 0), (75 + 30) / 1.5);
}

TEST(ResizeTest, BilinearKeepsRampsAndSizesKeepImages) {
  ImageU8 ramp(8, 3, 1);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 8; ++x) *ramp.at(x, y) = static_cast<uint8_t>(20 * x + 10);
  }
  const ImageU8 large = ResizeBilinear(ramp, 32, 9);
  for (int x = 2; x < 30; ++x) EXPECT_NEAR(*large.at(x, 4), 20 * ((x + 0.5) / 4 - 0.5) + 10, 0.51);
  const ImageU8 image = RandomImage(7, 5, 3);
  EXPECT_EQ(ResizeBilinear(image, 7, 5), image);
  EXPECT_EQ(ResizeArea(image, 7, 5), image);
  const ImageU8 fitted = FitInto(image, 70, 20);
  EXPECT_EQ(fitted.width(), 28);
  EXPECT_EQ(fitted.height(), 20);
  EXPECT_EQ(*ResizeBilinear(ImageU8(1, 1, 1, 9), 4, 4).at(3, 3), 9);
}

TEST(ResizeTest, FloatsAreClampedAndRounded) {
  ImageF image(4, 1, 1);
  image.values()[0] = -3, image.values()[1] = 400, image.values()[2] = 2.6f, image.values()[3] = 2.4f;
  const ImageU8 u8 = ToU8(image);
  EXPECT_EQ(std::vector<uint8_t>(u8.values().begin(), u8.values().end()), (std::vector<uint8_t>{0, 255, 3, 2}));
  EXPECT_EQ(ToU8(ToFloat(u8)), u8);
}

TEST(PanelsTest, HeatGrowsLighterWithTheDifference) {
  float before = -1;
  for (int i = 0; i <= 100; ++i) {
    const Colour colour = HeatColour(static_cast<float>(i) / 100);
    const float luma = 0.299f * colour[0] + 0.587f * colour[1] + 0.114f * colour[2];
    EXPECT_GE(luma, before);
    before = luma;
  }
  EXPECT_EQ(HeatColour(-1), HeatColour(0));
  EXPECT_EQ(HeatColour(7), HeatColour(1));
  ImageU8 a(2, 1, 3), b(2, 1, 3);
  b.at(1, 0)[0] = 30;  // a mean squared difference of 300
  const ImageU8 heat = SquaredDifferenceHeat(a, b, 600);
  const Colour half = HeatColour(0.5f);
  EXPECT_TRUE(std::equal(half.begin(), half.end(), heat.at(1, 0)));
  EXPECT_LT(Sum(heat), 3 * 255);
}

TEST(PanelsTest, PicturesStandWhereTheyShould) {
  const ImageU8 picture = RandomImage(30, 20, 3);
  const ImageU8 row = SideBySide({{picture, "left"}, {ImageU8(10, 40, 1, 77), "a long label"}}, 5);
  EXPECT_EQ(row.width(), 5 + 30 + 5 + 10 + 5);
  const int top = row.height() - 5 - 40;
  EXPECT_TRUE(std::equal(picture.at(3, 7), picture.at(3, 7) + 3, row.at(8, top + 7)));
  EXPECT_EQ(row.at(49, top + 39)[2], 77);
  const ImageU8 both = Stacked({row, HeatLegend(30, 32)});
  EXPECT_EQ(both.width(), row.width());
  EXPECT_GT(both.height(), row.height());
}

}  // namespace
}  // namespace likeness
