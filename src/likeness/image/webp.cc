#include "likeness/image/webp.h"

#include <webp/decode.h>
#include <webp/encode.h>

#include <memory>

#include "likeness/base/error.h"

namespace likeness {
namespace {

constexpr int64_t kMostPixels = int64_t{1} << 26;

const uint8_t* Data(std::string_view bytes) { return reinterpret_cast<const uint8_t*>(bytes.data()); }

}  // namespace

bool IsWebp(std::string_view bytes) {
  return bytes.size() >= 12 && bytes.starts_with("RIFF") && bytes.substr(8, 4) == "WEBP";
}

ImageInfo ReadWebpInfo(const std::filesystem::path& path_for_errors, std::string_view bytes) {
  WebPBitstreamFeatures features;
  if (WebPGetFeatures(Data(bytes), bytes.size(), &features) != VP8_STATUS_OK) {
    throw FileError(path_for_errors, "is no readable WebP");
  }
  if (features.has_animation != 0) throw FileError(path_for_errors, "is an animated WebP; expected a still picture");
  if (features.width < 1 || features.height < 1 || int64_t{features.width} * features.height > kMostPixels) {
    throw FileError(path_for_errors, fmt::format("a WebP of {} x {} pixels; at most {} are read", features.width,
                                                 features.height, kMostPixels));
  }
  return {features.width, features.height, features.has_alpha != 0 ? 4 : 3};
}

ImageU8 DecodeWebp(const std::filesystem::path& path_for_errors, std::string_view bytes, int channels) {
  const ImageInfo info = ReadWebpInfo(path_for_errors, bytes);
  ImageU8 image(info.width, info.height, channels == 1 ? 3 : channels);
  const size_t size = image.values().size();
  const int stride = info.width * image.channels();
  const auto decode = channels == 4 ? WebPDecodeRGBAInto : WebPDecodeRGBInto;
  if (decode(Data(bytes), bytes.size(), image.row(0), size, stride) == nullptr) {
    throw FileError(path_for_errors, "is a damaged WebP");
  }
  if (channels != 1) return image;
  ImageU8 luma(info.width, info.height, 1);
  for (int y = 0; y < info.height; ++y) {
    for (int x = 0; x < info.width; ++x) {
      const uint8_t* p = image.at(x, y);
      *luma.at(x, y) = static_cast<uint8_t>((299 * p[0] + 587 * p[1] + 114 * p[2] + 500) / 1000);
    }
  }
  return luma;
}

std::string EncodeWebp(const ImageU8& image) {
  LIKENESS_CHECK(!image.empty() && image.channels() >= 3);
  uint8_t* data = nullptr;
  const auto encode = image.channels() == 4 ? WebPEncodeLosslessRGBA : WebPEncodeLosslessRGB;
  const size_t size = encode(image.row(0), image.width(), image.height(), image.width() * image.channels(), &data);
  const std::unique_ptr<uint8_t, decltype(&WebPFree)> owner(data, &WebPFree);
  if (size == 0) throw Error("WebP: cannot encode {} x {} pixels", image.width(), image.height());
  return {reinterpret_cast<const char*>(data), size};
}

}  // namespace likeness
