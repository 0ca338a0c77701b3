#include "likeness/image/avif.h"

#include <avif/avif.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "likeness/base/file.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/image/image_io.h"
#include "likeness/image/metrics.h"

namespace likeness {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// Smooth, with a bright mark in the top left corner so that a flip shows.
ImageU8 Picture(int width = 60, int height = 44) {
  ImageU8 image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at(x, y)[0] = static_cast<uint8_t>(40 + 2 * x);
      image.at(x, y)[1] = static_cast<uint8_t>(30 + 3 * y);
      image.at(x, y)[2] = static_cast<uint8_t>(x < 12 && y < 12 ? 230 : 60);
    }
  }
  return image;
}

TEST(AvifTest, WithoutLossEveryPixelComesBack) {
  const std::string bytes = EncodeAvif(Picture(), 0);
  EXPECT_TRUE(IsAvif(bytes));
  EXPECT_EQ(DecodeAvif("a.avif", bytes, 3), Picture());
  const ImageInfo info = ReadAvifInfo("a.avif", bytes);
  EXPECT_EQ(info.width, 60);
  EXPECT_EQ(info.height, 44);
  EXPECT_EQ(info.channels, 3);
}

TEST(AvifTest, FilesAreToldByTheirContent) {
  const ScratchFolder scratch;
  WriteFile(scratch / "misnamed.png", EncodeAvif(Picture()));
  const ImageU8 read = ReadImage(scratch / "misnamed.png");
  const ImageU8 everywhere(60, 44, 1, 255);
  EXPECT_GT(PsnrDb(MaskedSquaredError(read, Picture(), everywhere).Mean()), 35);
  EXPECT_EQ(ReadImageInfo(scratch / "misnamed.png").width, 60);
  EXPECT_EQ(ReadImage(scratch / "misnamed.png", 4).at(3, 3)[3], 255);
}

TEST(AvifTest, GreyIsLuma) {
  const ImageU8 grey = DecodeAvif("a.avif", EncodeAvif(Picture(), 0), 1);
  const ImageU8 picture = Picture();
  ASSERT_EQ(grey.channels(), 1);
  for (int y = 0; y < 44; y += 7) {
    for (int x = 0; x < 60; x += 7) {
      const uint8_t* rgb = picture.at(x, y);
      EXPECT_NEAR(*grey.at(x, y), 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2], 0.51);
    }
  }
}

TEST(AvifTest, DamagedFilesAreErrorsOrPictures) {
  const std::string good = EncodeAvif(Picture());
  for (size_t length = 0; length < good.size(); ++length) {
    EXPECT_THAT(ErrorOf([&] { DecodeImage("cut.avif", good.substr(0, length)); }), HasSubstr("cut.avif")) << length;
  }
  Random random(5);
  for (int round = 0; round < 600; ++round) {
    std::string bytes = good;
    for (int64_t i = 0, n = 1 + random.Below(3); i < n; ++i) {
      bytes[static_cast<size_t>(random.Below(static_cast<int64_t>(bytes.size())))] = static_cast<char>(random.Below(256));
    }
    const std::string error = ErrorOf([&] { DecodeImage("a.avif", bytes); });
    EXPECT_TRUE(error.empty() || error.find("a.avif") != std::string::npos) << error;
  }
}

TEST(AvifTest, LiesAboutTheSizeAreErrors) {
  std::string bytes = EncodeAvif(Picture());
  const size_t ispe = bytes.find("ispe");
  ASSERT_NE(ispe, std::string::npos);
  for (const std::string& side : {std::string("\x00\x00\xff\xff", 4), std::string("\xff\xff\xff\xff", 4)}) {
    std::string lie = bytes;
    lie.replace(ispe + 8, 4, side).replace(ispe + 12, 4, side);
    EXPECT_NE(ErrorOf([&] { DecodeImage("lie.avif", lie); }), "");
  }
}

TEST(AvifTest, TurnedPicturesAreRefused) {
  std::unique_ptr<avifImage, decltype(&avifImageDestroy)> image(avifImageCreate(8, 6, 8, AVIF_PIXEL_FORMAT_YUV444),
                                                                &avifImageDestroy);
  avifImageAllocatePlanes(image.get(), AVIF_PLANES_YUV);
  for (int plane = 0; plane < 3; ++plane) {
    std::fill_n(image->yuvPlanes[plane], image->yuvRowBytes[plane] * 6, uint8_t{128});
  }
  image->transformFlags = AVIF_TRANSFORM_IMIR;
  const std::unique_ptr<avifEncoder, decltype(&avifEncoderDestroy)> encoder(avifEncoderCreate(), &avifEncoderDestroy);
  avifRWData data = AVIF_DATA_EMPTY;
  ASSERT_EQ(avifEncoderWrite(encoder.get(), image.get(), &data), AVIF_RESULT_OK);
  const std::string bytes(reinterpret_cast<const char*>(data.data), data.size);
  avifRWDataFree(&data);
  EXPECT_THAT(ErrorOf([&] { DecodeImage("turned.avif", bytes); }), AllOf(HasSubstr("turned.avif"), HasSubstr("mirrored")));
}

}  // namespace
}  // namespace likeness
