#include "likeness/train/image_crop.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "likeness/base/testing.h"
#include "likeness/capture/layout.h"
#include "likeness/image/image_io.h"
#include "likeness/train/synthetic_capture.h"

namespace likeness {
namespace {

// A different colour at every pixel; an L of head pixels.
HeadImage SmallImage() {
  HeadImage image = {ImageU8(9, 7, 3), ImageU8(9, 7, 1)};
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 9; ++x) {
      image.colour.at(x, y)[0] = static_cast<uint8_t>(10 * x);
      image.colour.at(x, y)[1] = static_cast<uint8_t>(10 * y);
      image.colour.at(x, y)[2] = 7;
      *image.head.at(x, y) = (x == 2 || y == 5) ? 255 : 0;
    }
  }
  return image;
}

TEST(ImageCrop, IsAPieceOfTheImageAboutAHeadPixel) {
  const HeadImage image = SmallImage();
  std::set<std::pair<int, int>> begins;
  for (uint64_t seed = 0; seed < 300; ++seed) {
    const ImageCrop crop = CropAtRandom(image, 3, 3, seed);
    begins.insert({crop.x0, crop.y0});
    ASSERT_TRUE(crop.x0 >= 0 && crop.x0 <= 6 && crop.y0 >= 0 && crop.y0 <= 4);
    bool head = false;
    for (int y = 0; y < 3; ++y) {
      for (int x = 0; x < 3; ++x) {
        for (int c = 0; c < 3; ++c) {
          ASSERT_EQ(crop.pixels.colour.at(x, y)[c], image.colour.at(crop.x0 + x, crop.y0 + y)[c]);
        }
        ASSERT_EQ(*crop.pixels.head.at(x, y), *image.head.at(crop.x0 + x, crop.y0 + y));
        head = head || *crop.pixels.head.at(x, y) != 0;
      }
    }
    EXPECT_TRUE(head);
    const ImageCrop again = CropAtRandom(image, 3, 3, seed);
    EXPECT_EQ(again.x0, crop.x0);
    EXPECT_EQ(again.y0, crop.y0);
  }
  // Middles are (2, 0 ... 6) and (0 ... 8, 5), moved inwards by a pixel at the borders.
  std::set<std::pair<int, int>> expected;
  for (int y = 0; y < 7; ++y) expected.insert({1, std::clamp(y - 1, 0, 4)});
  for (int x = 0; x < 9; ++x) expected.insert({std::clamp(x - 1, 0, 6), 4});
  EXPECT_EQ(begins, expected);
}

TEST(ImageCrop, MayBeLargerThanTheImage) {
  const HeadImage image = SmallImage();
  const ImageCrop crop = CropAtRandom(image, 13, 8, 1);
  EXPECT_EQ(crop.x0, -2);
  EXPECT_EQ(crop.y0, 0);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 13; ++x) {
      const bool inside = x >= 2 && x < 11 && y < 7;
      EXPECT_EQ(*crop.pixels.head.at(x, y), inside ? *image.head.at(x - 2, y) : 0);
      EXPECT_EQ(crop.pixels.colour.at(x, y)[2], inside ? 7 : 0);
    }
  }
}

TEST(ImageCrop, OfAnImageWithoutAHeadCountsNothing) {
  HeadImage image = SmallImage();
  for (uint8_t& value : image.head.values()) value = 0;
  const ImageCrop crop = CropAtRandom(image, 3, 3, 1);
  EXPECT_EQ(crop.x0, 3);
  EXPECT_EQ(crop.y0, 2);
}

// The mesh covers what the mask says; a black stripe over the face is background by its colour.
TEST(HeadImage, MaskMeshAndBackground) {
  const ScratchFolder folder;
  SyntheticCapture synthetic;
  synthetic.picture = 24;
  synthetic.Write(folder / "capture");
  const auto capture = OpenCapture(folder / "capture");
  const FrameId frame = capture->frames()[1];
  const Camera& camera = capture->cameras()[1];
  const TrackedFrame tracked = capture->ReadTracked(frame);
  const CaptureLayout layout(folder / "capture");
  const HeadImage masked = ReadHeadImage(*capture, frame, camera, tracked);
  EXPECT_EQ(masked.head, *capture->ReadHeadMask(frame, camera));
  EXPECT_EQ(masked.colour, capture->ReadCameraImage(frame, camera));

  std::filesystem::remove(layout.HeadMask(frame, camera.name));
  EXPECT_EQ(ReadHeadImage(*capture, frame, camera, tracked).head, masked.head);
  ImageU8 image = masked.colour;
  for (int x = 0; x < image.width(); ++x) {
    for (int y = 11; y < image.height(); ++y) std::fill_n(image.at(x, y), 3, uint8_t{0});
  }
  WritePng(layout.Image(frame, camera.name), image);
  const HeadImage cut = ReadHeadImage(*capture, frame, camera, tracked);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) EXPECT_EQ(*cut.head.at(x, y), y < 11 ? *masked.head.at(x, y) : 0);
  }
}

}  // namespace
}  // namespace likeness
