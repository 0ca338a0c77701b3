// Our own unfiltering of PNG rows against libpng's, on any rows: width, colour type, then rows with their filters.

#include <libdeflate.h>
#include <png.h>

#include <memory>

#include "fuzz.h"
#include "likeness/image/image_io.h"
#include "likeness/image/png.h"

namespace likeness {
namespace {

void AppendBigEndian(std::string* file, uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) file->push_back(static_cast<char>(value >> shift & 255));
}

void AppendChunk(std::string* file, const std::string& name, const std::string& data) {
  AppendBigEndian(file, static_cast<uint32_t>(data.size()));
  *file += name + data;
  AppendBigEndian(file, libdeflate_crc32(0, (name + data).data(), name.size() + data.size()));
}

std::string Deflated(std::string_view rows) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(1), &libdeflate_free_compressor);
  std::string packed(libdeflate_zlib_compress_bound(compressor.get(), rows.size()), '\0');
  packed.resize(libdeflate_zlib_compress(compressor.get(), rows.data(), rows.size(), packed.data(), packed.size()));
  return packed;
}

std::optional<ImageU8> DecodeByLibpng(std::string_view file, int width, int height, int channels) {
  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  ImageU8 image(width, height, channels);
  const bool begun = png_image_begin_read_from_memory(&png, file.data(), file.size()) != 0;
  png.format = channels == 1 ? PNG_FORMAT_GRAY : channels == 3 ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
  const bool done = begun && png_image_finish_read(&png, nullptr, image.row(0), 0, nullptr) != 0;
  png_image_free(&png);
  return done ? std::optional(image) : std::nullopt;
}

}  // namespace

void fuzz::Run(std::string_view bytes) {
  if (bytes.size() < 3) return;
  const int width = 1 + static_cast<uint8_t>(bytes[0]) % 40;
  const int kind = static_cast<uint8_t>(bytes[1]) % 3;
  const int channels = kind == 0 ? 1 : kind == 1 ? 3 : 4;
  const std::string_view rows = bytes.substr(2);
  const size_t row_bytes = static_cast<size_t>(width) * channels + 1;
  const int height = static_cast<int>(rows.size() / row_bytes);
  if (height < 1) return;

  std::string header;
  AppendBigEndian(&header, static_cast<uint32_t>(width));
  AppendBigEndian(&header, static_cast<uint32_t>(height));
  header += {'\x08', "\0\2\6"[kind], '\0', '\0', '\0'};
  std::string file = "\x89PNG\r\n\x1a\n";
  AppendChunk(&file, "IHDR", header);
  AppendChunk(&file, "IDAT", Deflated(rows.substr(0, row_bytes * height)));
  AppendChunk(&file, "IEND", "");

  const auto ours = Parsed([&] { return *DecodeCommonPng(kPath, file, channels); });
  LIKENESS_CHECK(ours == DecodeByLibpng(file, width, height, channels));
}

}  // namespace likeness
