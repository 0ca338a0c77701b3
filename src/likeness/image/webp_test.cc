#include "likeness/image/webp.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/testing.h"

namespace likeness {
namespace {

using testing::HasSubstr;

ImageU8 Pattern(int channels) {
  ImageU8 image(37, 23, channels);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      for (int c = 0; c < channels; ++c) image.at(x, y)[c] = static_cast<uint8_t>(1 + (7 * x + 11 * y + 50 * c) % 255);
    }
  }
  return image;
}

TEST(Webp, GivesBackWhatWasEncoded) {
  for (const int channels : {3, 4}) {
    const ImageU8 image = Pattern(channels);
    const std::string bytes = EncodeWebp(image);
    EXPECT_EQ(DecodeImage("a.webp", bytes, channels), image);
    const ImageInfo info = ReadImageInfo("a.webp", bytes);
    EXPECT_EQ(info.width, 37);
    EXPECT_EQ(info.height, 23);
    EXPECT_EQ(info.channels, channels);
  }
}

TEST(Webp, GivesGreyOfColour) {
  const ImageU8 image = Pattern(3), grey = DecodeImage("a.webp", EncodeWebp(image), 1);
  ASSERT_EQ(grey.channels(), 1);
  const uint8_t* p = image.at(5, 6);
  EXPECT_NEAR(*grey.at(5, 6), 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2], 1);
}

TEST(Webp, RefusesWhatIsCutOff) {
  const std::string bytes = EncodeWebp(Pattern(4));
  for (const size_t length : {size_t{12}, size_t{20}, bytes.size() / 2, bytes.size() - 1}) {
    EXPECT_THAT(ErrorOf([&] { DecodeImage("cut.webp", bytes.substr(0, length), 4); }), HasSubstr("cut.webp"));
  }
}

}  // namespace
}  // namespace likeness
