#include "likeness/image/image_io.h"

#include <png.h>
#include <turbojpeg.h>

#include <csetjmp>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>

#include "likeness/base/error.h"
#include "likeness/base/file.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxSide = 32768;

bool IsPng(std::string_view bytes) { return bytes.starts_with("\x89PNG\r\n\x1a\n"); }
bool IsJpeg(std::string_view bytes) { return bytes.starts_with("\xff\xd8\xff"); }

void CheckSize(const fs::path& path, int64_t width, int64_t height) {
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide) {
    throw FileError(path,
                    fmt::format("an image of {} x {} pixels; at most {} a side are read", width, height, kMaxSide));
  }
}

struct PngImage {
  png_image image = {};
  PngImage() { image.version = PNG_IMAGE_VERSION; }
  ~PngImage() { png_image_free(&image); }
  PngImage(const PngImage&) = delete;
  PngImage& operator=(const PngImage&) = delete;
};

ImageU8 DecodePng(const fs::path& path, std::string_view bytes, int channels) {
  PngImage png;
  if (png_image_begin_read_from_memory(&png.image, bytes.data(), bytes.size()) == 0) {
    throw FileError(path, fmt::format("is no readable PNG: {}", png.image.message));
  }
  CheckSize(path, png.image.width, png.image.height);
  // A PNG cannot expand its data by more than zlib's factor of 1032.
  const double raw_bytes = static_cast<double>(png.image.width) * png.image.height / 8;
  if (raw_bytes > 1040.0 * static_cast<double>(bytes.size())) {
    throw FileError(path, fmt::format("claims {} x {} pixels but holds only {} bytes: cut off or damaged",
                                      png.image.width, png.image.height, bytes.size()));
  }
  png.image.format = channels == 1 ? PNG_FORMAT_GRAY : channels == 3 ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
  ImageU8 image(static_cast<int>(png.image.width), static_cast<int>(png.image.height), channels);
  const png_color black = {0, 0, 0};
  if (png_image_finish_read(&png.image, &black, image.row(0), 0, nullptr) == 0) {
    throw FileError(path, fmt::format("is a damaged PNG: {}", png.image.message));
  }
  return image;
}

using TurboJpeg = std::unique_ptr<void, decltype(&tjDestroy)>;

ImageU8 DecodeJpeg(const fs::path& path, std::string_view bytes, int channels) {
  const TurboJpeg jpeg(tjInitDecompress(), &tjDestroy);
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (tjDecompressHeader3(jpeg.get(), data, bytes.size(), &width, &height, &subsampling, &colours) != 0) {
    throw FileError(path, fmt::format("is no readable JPEG: {}", tjGetErrorStr2(jpeg.get())));
  }
  CheckSize(path, width, height);
  ImageU8 image(width, height, channels);
  const int format = channels == 1 ? TJPF_GRAY : channels == 3 ? TJPF_RGB : TJPF_RGBA;
  if (tjDecompress2(jpeg.get(), data, bytes.size(), image.row(0), width, 0, height, format, TJFLAG_ACCURATEDCT) != 0) {
    throw FileError(path, fmt::format("is a damaged JPEG: {}", tjGetErrorStr2(jpeg.get())));
  }
  return image;
}

}  // namespace

ImageInfo ReadImageInfo(const fs::path& path) {
  const std::string bytes = ReadFile(path);
  if (IsPng(bytes)) {
    PngImage png;
    if (png_image_begin_read_from_memory(&png.image, bytes.data(), bytes.size()) == 0) {
      throw FileError(path, fmt::format("is no readable PNG: {}", png.image.message));
    }
    CheckSize(path, png.image.width, png.image.height);
    return {static_cast<int>(png.image.width), static_cast<int>(png.image.height),
            static_cast<int>(PNG_IMAGE_SAMPLE_CHANNELS(png.image.format & ~PNG_FORMAT_FLAG_COLORMAP))};
  }
  if (IsJpeg(bytes)) {
    const ImageU8 image = DecodeJpeg(path, bytes, 3);
    return {image.width(), image.height(), 3};
  }
  throw FileError(path, "is neither PNG nor JPEG");
}

bool LooksWholePng(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  char begin[8], end[8];
  if (!in.read(begin, sizeof(begin)) || !IsPng({begin, sizeof(begin)})) return false;
  // The last chunk, IEND, is empty: its length, name and checksum are the last twelve bytes.
  in.seekg(-static_cast<std::streamoff>(sizeof(end)), std::ios::end);
  return in.read(end, sizeof(end)) && std::string_view(end, sizeof(end)) == "IEND\xae\x42\x60\x82";
}

ImageU8 ReadImage(const fs::path& path, int channels) {
  LIKENESS_CHECK(channels == 1 || channels == 3 || channels == 4);
  const std::string bytes = ReadFile(path);
  if (IsPng(bytes)) return DecodePng(path, bytes, channels);
  if (IsJpeg(bytes)) return DecodeJpeg(path, bytes, channels);
  throw FileError(path, "is neither PNG nor JPEG");
}

std::string EncodePng(const ImageU8& image, int compression) {
  LIKENESS_CHECK(!image.empty() && image.channels() != 2 && image.channels() <= 4);
  std::string bytes;
  png_structp png = png_create_write_struct(
      PNG_LIBPNG_VER_STRING, nullptr, [](png_structp, png_const_charp message) { throw Error("PNG: {}", message); },
      nullptr);
  png_infop info = png_create_info_struct(png);
  try {
    png_set_write_fn(
        png, &bytes,
        [](png_structp p, png_bytep data, size_t size) {
          static_cast<std::string*>(png_get_io_ptr(p))->append(reinterpret_cast<const char*>(data), size);
        },
        [](png_structp) {});
    png_set_compression_level(png, compression);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, compression <= 1 ? PNG_FILTER_UP : PNG_FAST_FILTERS);
    const int type = image.channels() == 1   ? PNG_COLOR_TYPE_GRAY
                     : image.channels() == 3 ? PNG_COLOR_TYPE_RGB
                                             : PNG_COLOR_TYPE_RGB_ALPHA;
    png_set_IHDR(png, info, image.width(), image.height(), 8, type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    for (int y = 0; y < image.height(); ++y) png_write_row(png, image.row(y));
    png_write_end(png, nullptr);
  } catch (...) {
    png_destroy_write_struct(&png, &info);
    throw;
  }
  png_destroy_write_struct(&png, &info);
  return bytes;
}

std::string EncodeJpeg(const ImageU8& image, int quality) {
  LIKENESS_CHECK(!image.empty() && image.channels() == 3);
  const TurboJpeg jpeg(tjInitCompress(), &tjDestroy);
  unsigned char* data = nullptr;
  unsigned long size = 0;
  const int code = tjCompress2(jpeg.get(), image.row(0), image.width(), 0, image.height(), TJPF_RGB, &data, &size,
                               TJSAMP_444, quality, TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, decltype(&tjFree)> owner(data, &tjFree);
  if (code != 0) throw Error("JPEG: {}", tjGetErrorStr2(jpeg.get()));
  return {reinterpret_cast<const char*>(data), size};
}

void WritePng(const fs::path& path, const ImageU8& image, int compression) {
  WriteFile(path, EncodePng(image, compression));
}

void WriteJpeg(const fs::path& path, const ImageU8& image, int quality) { WriteFile(path, EncodeJpeg(image, quality)); }

}  // namespace likeness
