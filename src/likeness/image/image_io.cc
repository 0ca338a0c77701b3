#include "likeness/image/image_io.h"

#include <png.h>
#include <turbojpeg.h>

#include <fstream>
#include <memory>
#include <optional>
#include <string>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/image/avif.h"
#include "likeness/image/png.h"
#include "likeness/image/webp.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxSide = 32768;

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

// Palettes, 16 bits, interlacing, and whatever needs a conversion of colours.
ImageU8 DecodeOddPng(const fs::path& path, std::string_view bytes, int channels) {
  PngImage png;
  if (png_image_begin_read_from_memory(&png.image, bytes.data(), bytes.size()) == 0) {
    throw FileError(path, fmt::format("is no readable PNG: {}", png.image.message));
  }
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

ImageU8 DecodePng(const fs::path& path, std::string_view bytes, int channels) {
  const PngHeader header = ReadPngHeader(path, bytes);
  CheckSize(path, header.width, header.height);
  if (std::optional<ImageU8> image = DecodeCommonPng(path, bytes, channels)) return std::move(*image);
  return DecodeOddPng(path, bytes, channels);
}

using TurboJpeg = std::unique_ptr<void, decltype(&tjDestroy)>;

ImageInfo JpegHeader(const fs::path& path, tjhandle jpeg, std::string_view bytes) {
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (tjDecompressHeader3(jpeg, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), &width, &height,
                          &subsampling, &colours) != 0) {
    throw FileError(path, fmt::format("is no readable JPEG: {}", tjGetErrorStr2(jpeg)));
  }
  CheckSize(path, width, height);
  return {width, height, colours == TJCS_GRAY ? 1 : 3};
}

ImageU8 DecodeJpeg(const fs::path& path, std::string_view bytes, int channels) {
  const TurboJpeg jpeg(tjInitDecompress(), &tjDestroy);
  const ImageInfo info = JpegHeader(path, jpeg.get(), bytes);
  // A block of 8 x 8 values takes a bit at least; with the coarsest subsampling eight of them make 32 x 32 pixels.
  constexpr size_t kMostPixelsPerByte = 1024;
  if (static_cast<size_t>(info.width) * info.height / kMostPixelsPerByte > bytes.size()) {
    throw FileError(path, fmt::format("claims {} x {} pixels but holds only {} bytes: cut off or damaged", info.width,
                                      info.height, bytes.size()));
  }
  ImageU8 image(info.width, info.height, channels);
  const int format = channels == 1 ? TJPF_GRAY : channels == 3 ? TJPF_RGB : TJPF_RGBA;
  if (tjDecompress2(jpeg.get(), reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), image.row(0),
                    info.width, 0, info.height, format, TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS) != 0) {
    throw FileError(path, fmt::format("is a damaged JPEG: {}", tjGetErrorStr2(jpeg.get())));
  }
  return image;
}

}  // namespace

ImageInfo ReadImageInfo(const fs::path& path) {
  constexpr size_t kPngHeaderBytes = 64;  // other formats keep the size anywhere
  const std::string start = ReadFileStart(path, kPngHeaderBytes);
  return ReadImageInfo(path, IsPng(start) ? start : ReadFile(path));
}

ImageInfo ReadImageInfo(const fs::path& path_for_errors, std::string_view bytes) {
  if (IsPng(bytes)) {
    const PngHeader header = ReadPngHeader(path_for_errors, bytes);
    CheckSize(path_for_errors, header.width, header.height);
    constexpr int kChannels[] = {1, 0, 3, 3, 2, 0, 4};
    const bool known = header.colour_type >= 0 && header.colour_type <= 6;
    return {static_cast<int>(header.width), static_cast<int>(header.height), known ? kChannels[header.colour_type] : 0};
  }
  if (IsJpeg(bytes)) {
    const TurboJpeg jpeg(tjInitDecompress(), &tjDestroy);
    return JpegHeader(path_for_errors, jpeg.get(), bytes);
  }
  if (IsAvif(bytes)) return ReadAvifInfo(path_for_errors, bytes);
  if (IsWebp(bytes)) return ReadWebpInfo(path_for_errors, bytes);
  throw FileError(path_for_errors, "is neither PNG nor JPEG nor AVIF nor WebP");
}

bool LooksWholePng(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  char begin[8], end[8];
  if (!in.read(begin, sizeof(begin)) || !IsPng({begin, sizeof(begin)})) return false;
  // The last chunk, IEND, is empty: its length, name and checksum are the last twelve bytes.
  in.seekg(-static_cast<std::streamoff>(sizeof(end)), std::ios::end);
  return in.read(end, sizeof(end)) && std::string_view(end, sizeof(end)) == "IEND\xae\x42\x60\x82";
}

ImageU8 ReadImage(const fs::path& path, int channels) { return DecodeImage(path, ReadFile(path), channels); }

ImageU8 DecodeImage(const fs::path& path_for_errors, std::string_view bytes, int channels) {
  LIKENESS_CHECK(channels == 1 || channels == 3 || channels == 4);
  if (IsPng(bytes)) return DecodePng(path_for_errors, bytes, channels);
  if (IsJpeg(bytes)) return DecodeJpeg(path_for_errors, bytes, channels);
  if (IsAvif(bytes)) return DecodeAvif(path_for_errors, bytes, channels);
  if (IsWebp(bytes)) return DecodeWebp(path_for_errors, bytes, channels);
  throw FileError(path_for_errors, "is neither PNG nor JPEG nor AVIF nor WebP");
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
