// PNG and JPEG files against libpng, and in every damaged form.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include "likeness/base/file.h"
#include "likeness/base/random.h"
#include "likeness/base/testing.h"
#include "likeness/image/image_io.h"
#include "likeness/image/png.h"

namespace likeness {
namespace {

using ::testing::HasSubstr;

// Smooth with noise, so that all filters make sense.
ImageU8 Picture(int width, int height, int channels, uint64_t seed) {
  Random random(seed);
  ImageU8 image(width, height, channels);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) {
        image.at(x, y)[c] =
            static_cast<uint8_t>(3 * x + 5 * y * (c + 1) + random.Below(random.Below(40) == 0 ? 256 : 9));
      }
    }
  }
  return image;
}

struct LibpngOptions {
  int colour_type = PNG_COLOR_TYPE_RGB;
  int bit_depth = 8;
  int filters = PNG_ALL_FILTERS;
  bool interlaced = false;
  int chunk_bytes = 8192;
  double gamma = 0;          // 0: no gAMA chunk
  bool transparent = false;  // a tRNS chunk
};

// `image` holds the bytes of the rows as they are stored.
std::string LibpngEncode(const ImageU8& image, int width, const LibpngOptions& options) {
  std::string bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &bytes,
      [](png_structp p, png_bytep data, size_t size) {
        static_cast<std::string*>(png_get_io_ptr(p))->append(reinterpret_cast<const char*>(data), size);
      },
      [](png_structp) {});
  png_set_filter(png, PNG_FILTER_TYPE_BASE, options.filters);
  png_set_compression_buffer_size(png, static_cast<size_t>(options.chunk_bytes));
  png_set_IHDR(png, info, width, image.height(), options.bit_depth, options.colour_type,
               options.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  if (options.gamma > 0) png_set_gAMA(png, info, options.gamma);
  if (options.colour_type == PNG_COLOR_TYPE_PALETTE) {
    std::vector<png_color> palette(256);
    for (int i = 0; i < 256; ++i) palette[i] = {png_byte(i), png_byte(255 - i), png_byte(i * 7)};
    png_set_PLTE(png, info, palette.data(), 256);
  }
  png_color_16 colour = {0, 10, 20, 30, 40};
  if (options.transparent) png_set_tRNS(png, info, nullptr, 0, &colour);
  std::vector<png_bytep> rows;
  for (int y = 0; y < image.height(); ++y) rows.push_back(const_cast<png_bytep>(image.row(y)));
  png_set_rows(png, info, rows.data());
  png_write_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

ImageU8 LibpngDecode(const std::string& bytes, int channels) {
  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()), 0) << png.message;
  png.format = channels == 1 ? PNG_FORMAT_GRAY : channels == 3 ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
  ImageU8 image(static_cast<int>(png.width), static_cast<int>(png.height), channels);
  const png_color black = {0, 0, 0};
  EXPECT_NE(png_image_finish_read(&png, &black, image.row(0), 0, nullptr), 0) << png.message;
  return image;
}

class ImageTest : public ::testing::Test {
 protected:
  ImageU8 Read(const std::string& bytes, int channels) const {
    WriteFile(scratch_ / "a.png", bytes, Sync::kNo);
    return ReadImage(scratch_ / "a.png", channels);
  }
  std::string ReadError(const std::string& bytes, int channels = 3) const {
    return ErrorOf([&] { Read(bytes, channels); });
  }

  ScratchFolder scratch_;
};

TEST_F(ImageTest, EveryFilterAndSizeDecodesAsLibpngDoes) {
  uint64_t seed = 0;
  for (const int type : {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA}) {
    const int stored = type == PNG_COLOR_TYPE_GRAY ? 1 : type == PNG_COLOR_TYPE_RGB ? 3 : 4;
    for (const int filter :
         {PNG_FILTER_NONE, PNG_FILTER_SUB, PNG_FILTER_UP, PNG_FILTER_AVG, PNG_FILTER_PAETH, PNG_ALL_FILTERS}) {
      for (const auto& [width, height] : {std::pair(1, 1), {1, 2}, {2, 1}, {5, 7}, {16, 3}, {67, 45}}) {
        const ImageU8 image = Picture(width, height, stored, ++seed);
        LibpngOptions options;
        options.colour_type = type;
        options.filters = filter;
        options.chunk_bytes = seed % 2 == 0 ? 8192 : 64;  // one and many data chunks
        const std::string bytes = LibpngEncode(image, width, options);
        ASSERT_EQ(DecodeCommonPng("a", bytes, stored), image) << "filter " << filter << ", seed " << seed;
        for (const int channels : {1, 3, 4}) {
          ASSERT_EQ(Read(bytes, channels), LibpngDecode(bytes, channels))
              << stored << " to " << channels << " channels, filter " << filter << ", seed " << seed;
        }
      }
    }
  }
}

TEST_F(ImageTest, OddFilesDecodeAsLibpngDoes) {
  const auto check = [&](int stored_bytes, const LibpngOptions& options) {
    ImageU8 rows = Picture(stored_bytes * 19, 13, 1, 5);
    const std::string bytes = LibpngEncode(rows, 19, options);
    for (const int channels : {1, 3, 4}) EXPECT_EQ(Read(bytes, channels), LibpngDecode(bytes, channels));
  };
  LibpngOptions options;
  options.colour_type = PNG_COLOR_TYPE_PALETTE;
  check(1, options);
  options.colour_type = PNG_COLOR_TYPE_GRAY_ALPHA;
  check(2, options);
  options.bit_depth = 16;
  options.colour_type = PNG_COLOR_TYPE_RGB;
  check(6, options);
  options.bit_depth = 8;
  options.interlaced = true;
  check(3, options);
  options.interlaced = false;
  options.gamma = 1;
  check(3, options);
  options.gamma = 0.45455;
  check(3, options);
  options.gamma = 0;
  options.transparent = true;
  check(3, options);
}

TEST_F(ImageTest, WhatIsWrittenIsReadBackByUsAndByLibpng) {
  uint64_t seed = 100;
  for (const int channels : {1, 3, 4}) {
    for (const int compression : {0, 1, 3, 9}) {
      for (const auto& [width, height] : {std::pair(1, 1), {3, 2}, {64, 48}, {33, 65}}) {
        const ImageU8 image = Picture(width, height, channels, ++seed);
        WritePng(scratch_ / "b.png", image, compression);
        EXPECT_EQ(ReadImage(scratch_ / "b.png", channels), image);
        EXPECT_EQ(LibpngDecode(ReadFile(scratch_ / "b.png"), channels), image);
        EXPECT_TRUE(LooksWholePng(scratch_ / "b.png"));
        const ImageInfo info = ReadImageInfo(scratch_ / "b.png");
        EXPECT_EQ(info.width, width);
        EXPECT_EQ(info.height, height);
        EXPECT_EQ(info.channels, channels);
      }
    }
  }
  const ImageU8 smooth = Picture(200, 200, 3, 1);
  EXPECT_LT(EncodePng(smooth, 6).size(), EncodePng(smooth, 1).size());
}

TEST_F(ImageTest, TruncatedPngsAreErrors) {
  for (const int channels : {1, 3}) {
    const std::string bytes = EncodePng(Picture(20, 15, channels, 3), 1);
    for (size_t length = 0; length < bytes.size(); ++length) {
      EXPECT_THAT(ReadError(bytes.substr(0, length), channels), HasSubstr("a.png: ")) << length;
      EXPECT_FALSE(LooksWholePng(scratch_ / "a.png"));
    }
  }
  EXPECT_FALSE(LooksWholePng(scratch_ / "absent.png"));
}

TEST_F(ImageTest, DamagedPngsAreErrorsOrImages) {
  Random random(9);
  LibpngOptions odd;
  odd.interlaced = true;
  const ImageU8 image = Picture(20, 15, 3, 3);
  for (const std::string& bytes : {EncodePng(image, 1), LibpngEncode(image, 20, odd)}) {
    for (int round = 0; round < 300; ++round) {
      std::string damaged = bytes;
      for (int64_t i = 0, n = 1 + random.Below(3); i < n; ++i) {
        damaged[static_cast<size_t>(random.Below(static_cast<int64_t>(bytes.size())))] ^=
            static_cast<char>(1 << random.Below(8));
      }
      ReadError(damaged);
      ReadError(damaged, 1);
    }
  }
}

// A file of our own making with right checksums, so that damage gets past them.
std::string Chunk(const std::string& name, const std::string& data) {
  const auto u32 = [](uint32_t v) {
    return std::string{char(v >> 24 & 255), char(v >> 16 & 255), char(v >> 8 & 255), char(v & 255)};
  };
  uint32_t crc = ~0u;
  for (const char c : name + data) {
    crc ^= static_cast<uint8_t>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xedb88320u : 0);
  }
  return u32(static_cast<uint32_t>(data.size())) + name + data + u32(~crc);
}

std::string Header(uint32_t width, uint32_t height, int depth = 8, int type = 2, int interlace = 0) {
  std::string data;
  for (const uint32_t side : {width, height}) {
    for (int shift = 24; shift >= 0; shift -= 8) data += static_cast<char>(side >> shift & 255);
  }
  data += {char(depth), char(type), 0, 0, char(interlace)};
  return "\x89PNG\r\n\x1a\n" + Chunk("IHDR", data);
}

TEST_F(ImageTest, HeadersThatLieAreErrors) {
  // The data chunk of a 4 x 3 RGB image.
  const std::string good = EncodePng(Picture(4, 3, 3, 1), 1), data = good.substr(33, good.size() - 33 - 12);
  const std::string end = Chunk("IEND", "");
  EXPECT_EQ(ReadError(Header(4, 3) + data + end), "");
  EXPECT_THAT(ReadError(Header(4, 4) + data + end), HasSubstr("too few"));
  EXPECT_THAT(ReadError(Header(4, 2) + data + end), HasSubstr("too many"));
  EXPECT_THAT(ReadError(Header(30000, 30000) + data + end), HasSubstr("claims 30000 x 30000 pixels"));
  EXPECT_THAT(ReadError(Header(30000, 30000, 8, 2, 1) + data + end), HasSubstr("claims 30000 x 30000 pixels"));
  EXPECT_THAT(ReadError(Header(0, 3) + data + end), HasSubstr("an image of 0 x 3 pixels"));
  EXPECT_THAT(ReadError(Header(4, 1u << 31) + data + end), HasSubstr("an image of 4 x 2147483648 pixels"));
  EXPECT_THAT(ReadError(Header(~0u, ~0u) + data + end), HasSubstr("an image of"));
  EXPECT_NE(ReadError(Header(4, 3, 77) + data + end), "");
  EXPECT_NE(ReadError(Header(4, 3, 8, 9) + data + end), "");
  EXPECT_NE(ReadError(Header(4, 3) + end), "");
  EXPECT_THAT(ReadError(Header(4, 3) + data), HasSubstr("cut off"));
  EXPECT_THAT(ReadError(Header(4, 3) + Chunk("IDAT", "no deflate stream") + end), HasSubstr("cannot be inflated"));
  EXPECT_THAT(ReadError("\x89PNG\r\n\x1a\n" + data + end), HasSubstr("does not begin with a header"));
  EXPECT_THAT(ReadError("no picture"), HasSubstr("is neither PNG nor JPEG"));
  EXPECT_THAT(ReadError(""), HasSubstr("is neither PNG nor JPEG"));
  // One row with filter type 9, stored without compression.
  const std::string stored =
      std::string("\x78\x01\x01\x04\x00\xfb\xff\x09\x01\x02\x03", 11) + std::string("\x00\x32\x00\x10", 4);
  EXPECT_THAT(ReadError(Header(1, 1) + Chunk("IDAT", stored) + end), HasSubstr("row 0 has filter 9"));
}

TEST_F(ImageTest, JpegsAreReadAndDamagedOnesAreErrors) {
  ImageU8 smooth(40, 30, 3);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      smooth.at(x, y)[0] = static_cast<uint8_t>(100 + x), smooth.at(x, y)[1] = static_cast<uint8_t>(90 + y);
    }
  }
  WriteJpeg(scratch_ / "c.jpg", smooth, 95);
  const ImageU8 read = ReadImage(scratch_ / "c.jpg");
  ASSERT_TRUE(read.SameShape(smooth));
  for (size_t i = 0; i < read.values().size(); ++i) EXPECT_NEAR(read.values()[i], smooth.values()[i], 8);
  EXPECT_EQ(ReadImageInfo(scratch_ / "c.jpg").width, 40);
  const std::string bytes = EncodeJpeg(smooth);
  Random random(4);
  for (size_t length = 0; length + 2 < bytes.size(); ++length) EXPECT_NE(ReadError(bytes.substr(0, length)), "");
  for (int round = 0; round < 300; ++round) {
    std::string damaged = bytes;
    damaged[static_cast<size_t>(random.Below(static_cast<int64_t>(bytes.size())))] =
        static_cast<char>(random.Below(256));
    ReadError(damaged);
  }
  std::string vast = bytes;
  const size_t frame = vast.find("\xff\xc0");  // two bytes of length, one of depth, then height and width
  vast.replace(frame + 5, 4, "\x75\x30\x75\x30");
  EXPECT_THAT(ReadError(vast), HasSubstr("claims 30000 x 30000 pixels"));
}

}  // namespace
}  // namespace likeness
