#include "likeness/image/avif.h"

#include <avif/avif.h>

#include <memory>

#include "likeness/base/error.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kMostSide = 32768;
constexpr uint32_t kMostPixels = 1 << 26;

using Decoder = std::unique_ptr<avifDecoder, decltype(&avifDecoderDestroy)>;

avifROData Borrow(std::string_view bytes) { return {reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()}; }

void CheckSize(const fs::path& path, const avifImage& image) {
  if (image.width < 1 || image.height < 1 || image.width > kMostSide || image.height > kMostSide ||
      image.width > kMostPixels / image.height) {
    throw FileError(path, fmt::format("an AVIF of {} x {} pixels; at most {} in all are read", image.width,
                                      image.height, kMostPixels));
  }
}

// `bytes` are borrowed. Nothing is decoded yet.
Decoder Parse(const fs::path& path, std::string_view bytes) {
  Decoder decoder(avifDecoderCreate(), &avifDecoderDestroy);
  if (!decoder) throw std::bad_alloc();
  decoder->maxThreads = 1;
  decoder->ignoreExif = decoder->ignoreXMP = AVIF_TRUE;
  decoder->imageSizeLimit = kMostPixels;
  // Some writers leave out the optional record of the bit depth.
  decoder->strictFlags &= ~static_cast<avifStrictFlags>(AVIF_STRICT_PIXI_REQUIRED);
  avifResult result = avifDecoderSetIOMemory(decoder.get(), Borrow(bytes).data, bytes.size());
  if (result == AVIF_RESULT_OK) result = avifDecoderParse(decoder.get());
  if (result != AVIF_RESULT_OK) {
    throw FileError(path, fmt::format("is no readable AVIF: {}", avifResultToString(result)));
  }
  CheckSize(path, *decoder->image);
  return decoder;
}

// RGBA over black to RGB.
void LayOverBlack(const ImageU8& rgba, ImageU8* rgb) {
  const size_t pixels = rgba.values().size() / 4;
  const uint8_t* in = rgba.values().data();
  uint8_t* out = rgb->values().data();
  for (size_t i = 0; i < pixels; ++i, in += 4, out += 3) {
    for (int c = 0; c < 3; ++c) out[c] = static_cast<uint8_t>((in[c] * in[3] + 127) / 255);
  }
}

ImageU8 Luma(const ImageU8& rgb) {
  ImageU8 grey(rgb.width(), rgb.height(), 1);
  const uint8_t* in = rgb.values().data();
  for (uint8_t& value : grey.values()) {
    value = static_cast<uint8_t>((299 * in[0] + 587 * in[1] + 114 * in[2] + 500) / 1000);
    in += 3;
  }
  return grey;
}

}  // namespace

bool IsAvif(std::string_view bytes) {
  if (bytes.size() < 12 || bytes.substr(4, 4) != "ftyp") return false;
  const avifROData data = Borrow(bytes);
  return avifPeekCompatibleFileType(&data) == AVIF_TRUE;
}

ImageInfo ReadAvifInfo(const fs::path& path_for_errors, std::string_view bytes) {
  const Decoder decoder = Parse(path_for_errors, bytes);
  const avifImage& image = *decoder->image;
  const int colours = image.yuvFormat == AVIF_PIXEL_FORMAT_YUV400 ? 1 : 3;
  return {static_cast<int>(image.width), static_cast<int>(image.height), colours + (decoder->alphaPresent ? 1 : 0)};
}

ImageU8 DecodeAvif(const fs::path& path_for_errors, std::string_view bytes, int channels) {
  LIKENESS_CHECK(channels == 1 || channels == 3 || channels == 4);
  const Decoder decoder = Parse(path_for_errors, bytes);
  if ((decoder->image->transformFlags & (AVIF_TRANSFORM_IROT | AVIF_TRANSFORM_IMIR)) != 0) {
    throw FileError(path_for_errors,
                    "an AVIF that is to be turned or mirrored after decoding; expected one that is not");
  }
  const uint32_t width = decoder->image->width, height = decoder->image->height;
  if (const avifResult result = avifDecoderNextImage(decoder.get()); result != AVIF_RESULT_OK) {
    throw FileError(path_for_errors, fmt::format("is a damaged AVIF: {}", avifResultToString(result)));
  }
  if (decoder->image->width != width || decoder->image->height != height) {
    throw FileError(path_for_errors, "is a damaged AVIF: its picture has another size than the file says");
  }
  const bool needs_alpha = channels == 4 || decoder->image->alphaPlane != nullptr;
  ImageU8 image(static_cast<int>(decoder->image->width), static_cast<int>(decoder->image->height), needs_alpha ? 4 : 3);
  avifRGBImage rgb;
  avifRGBImageSetDefaults(&rgb, decoder->image);
  rgb.depth = 8;
  rgb.format = needs_alpha ? AVIF_RGB_FORMAT_RGBA : AVIF_RGB_FORMAT_RGB;
  rgb.pixels = image.row(0);
  rgb.rowBytes = static_cast<uint32_t>(image.width() * image.channels());
  if (const avifResult result = avifImageYUVToRGB(decoder->image, &rgb); result != AVIF_RESULT_OK) {
    throw FileError(path_for_errors,
                    fmt::format("an AVIF whose colours cannot be read: {}", avifResultToString(result)));
  }
  if (channels == 4) return image;
  if (needs_alpha) {
    ImageU8 laid(image.width(), image.height(), 3);
    LayOverBlack(image, &laid);
    image = std::move(laid);
  }
  return channels == 3 ? std::move(image) : Luma(image);
}

std::string EncodeAvif(const ImageU8& rgb, int quantizer) {
  LIKENESS_CHECK(!rgb.empty() && rgb.channels() == 3 && quantizer >= AVIF_QUANTIZER_LOSSLESS &&
                 quantizer <= AVIF_QUANTIZER_WORST_QUALITY);
  const std::unique_ptr<avifImage, decltype(&avifImageDestroy)> image(
      avifImageCreate(static_cast<uint32_t>(rgb.width()), static_cast<uint32_t>(rgb.height()), 8,
                      AVIF_PIXEL_FORMAT_YUV444),
      &avifImageDestroy);
  const std::unique_ptr<avifEncoder, decltype(&avifEncoderDestroy)> encoder(avifEncoderCreate(), &avifEncoderDestroy);
  if (!image || !encoder) throw std::bad_alloc();
  image->matrixCoefficients =
      quantizer == AVIF_QUANTIZER_LOSSLESS ? AVIF_MATRIX_COEFFICIENTS_IDENTITY : AVIF_MATRIX_COEFFICIENTS_BT601;
  avifRGBImage from;
  avifRGBImageSetDefaults(&from, image.get());
  from.format = AVIF_RGB_FORMAT_RGB;
  from.pixels = const_cast<uint8_t*>(rgb.row(0));  // only read from
  from.rowBytes = static_cast<uint32_t>(rgb.width() * 3);
  encoder->speed = AVIF_SPEED_FASTEST;
  encoder->minQuantizer = encoder->maxQuantizer = quantizer;
  avifRWData data = AVIF_DATA_EMPTY;
  const std::unique_ptr<avifRWData, decltype(&avifRWDataFree)> owner(&data, &avifRWDataFree);
  avifResult result = avifImageRGBToYUV(image.get(), &from);
  if (result == AVIF_RESULT_OK) result = avifEncoderWrite(encoder.get(), image.get(), &data);
  if (result != AVIF_RESULT_OK) throw Error("AVIF: {}", avifResultToString(result));
  return {reinterpret_cast<const char*>(data.data), data.size};
}

}  // namespace likeness
