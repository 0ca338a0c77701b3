#include "likeness/image/png.h"

#include <fmt/format.h>
#include <libdeflate.h>

#include <array>
#include <bit>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "likeness/base/error.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
constexpr size_t kHeaderBytes = 13;
constexpr size_t kAroundChunk = 12;  // length, name, checksum
constexpr uint32_t kSrgbGamma = 45455;

enum Filter : uint8_t { kNone = 0, kSub = 1, kUp = 2, kAverage = 3, kPaeth = 4, kFilterCount = 5 };

uint32_t ReadU32(std::string_view bytes) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<uint8_t>(bytes[i]);
  return value;
}

void AppendU32(std::string* bytes, uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes->push_back(static_cast<char>(value >> shift & 255));
}

struct Chunk {
  std::string_view name, data;
  bool whole = false;  // its checksum is right
};

// The chunk at the start of `rest`, which it is cut from. Throws Error when the file ends inside it.
Chunk TakeChunk(const fs::path& path, std::string_view* rest) {
  if (rest->size() < kAroundChunk || ReadU32(*rest) > rest->size() - kAroundChunk) {
    throw FileError(path, "is a damaged PNG: it is cut off");
  }
  const size_t length = ReadU32(*rest);
  Chunk chunk = {rest->substr(4, 4), rest->substr(8, length)};
  chunk.whole = libdeflate_crc32(0, rest->data() + 4, length + 4) == ReadU32(rest->substr(8 + length));
  rest->remove_prefix(length + kAroundChunk);
  return chunk;
}

Chunk TakeCriticalChunk(const fs::path& path, std::string_view* rest) {
  const Chunk chunk = TakeChunk(path, rest);
  if (!chunk.whole && (chunk.name[0] & 32) == 0) {
    throw FileError(path, fmt::format("is a damaged PNG: wrong checksum {} bytes before its end", rest->size()));
  }
  return chunk;
}

// Unfiltering. A row is `bytes` long and kBpp bytes a pixel; `up` is the row above, unfiltered.

uint8_t Paeth(int left, int up, int corner) {
  const int to_left = std::abs(up - corner), to_up = std::abs(left - corner),
            to_corner = std::abs(left + up - 2 * corner);
  if (to_left <= to_up && to_left <= to_corner) return static_cast<uint8_t>(left);
  return static_cast<uint8_t>(to_up <= to_corner ? up : corner);
}

void UnfilterUp(const uint8_t* in, const uint8_t* up, uint8_t* out, size_t bytes) {
  for (size_t i = 0; i < bytes; ++i) out[i] = static_cast<uint8_t>(in[i] + up[i]);
}

template <int kBpp>
void UnfilterPlainly(Filter filter, const uint8_t* in, const uint8_t* up, uint8_t* out, size_t bytes) {
  for (size_t i = 0; i < bytes; ++i) {
    const int left = i >= kBpp ? out[i - kBpp] : 0, corner = i >= kBpp ? up[i - kBpp] : 0;
    const int predicted = filter == kSub ? left : filter == kAverage ? (left + up[i]) / 2 : Paeth(left, up[i], corner);
    out[i] = static_cast<uint8_t>(in[i] + predicted);
  }
}

#if defined(__SSE2__)

// Pixels one after the other, as each needs the one before, but all channels of a pixel at once. Reads four bytes of
// `in` and `up` for the last pixel, too.
template <int kBpp, typename Predict>
void UnfilterPixels(const uint8_t* in, const uint8_t* up, uint8_t* out, size_t bytes, Predict predict) {
  const auto load = [](const uint8_t* from) {
    int value;
    std::memcpy(&value, from, 4);
    return _mm_cvtsi32_si128(value);
  };
  __m128i left = _mm_setzero_si128(), corner = left;
  for (size_t i = 0; i < bytes; i += kBpp) {
    const __m128i above = load(up + i);
    left = _mm_add_epi8(load(in + i), predict(left, above, corner));
    corner = above;
    const int value = _mm_cvtsi128_si32(left);
    std::memcpy(out + i, &value, kBpp);
  }
}

__m128i PredictLeft(__m128i left, __m128i, __m128i) { return left; }

__m128i PredictAverage(__m128i left, __m128i up, __m128i) {
  // _mm_avg_epu8 rounds up, PNG down.
  const __m128i odd = _mm_and_si128(_mm_xor_si128(left, up), _mm_set1_epi8(1));
  return _mm_sub_epi8(_mm_avg_epu8(left, up), odd);
}

__m128i PredictPaeth(__m128i left8, __m128i up8, __m128i corner8) {
  const __m128i zero = _mm_setzero_si128();
  const __m128i left = _mm_unpacklo_epi8(left8, zero), up = _mm_unpacklo_epi8(up8, zero),
                corner = _mm_unpacklo_epi8(corner8, zero);
  const auto magnitude = [&](__m128i v) { return _mm_max_epi16(v, _mm_sub_epi16(zero, v)); };
  const auto choose = [](__m128i mask, __m128i yes, __m128i no) {
    return _mm_or_si128(_mm_and_si128(mask, yes), _mm_andnot_si128(mask, no));
  };
  const __m128i du = _mm_sub_epi16(up, corner), dl = _mm_sub_epi16(left, corner);
  const __m128i to_left = magnitude(du), to_up = magnitude(dl), to_corner = magnitude(_mm_add_epi16(du, dl));
  const __m128i least = _mm_min_epi16(to_left, _mm_min_epi16(to_up, to_corner));
  const __m128i nearest =
      choose(_mm_cmpeq_epi16(to_left, least), left, choose(_mm_cmpeq_epi16(to_up, least), up, corner));
  return _mm_packus_epi16(nearest, zero);
}

template <int kBpp>
void UnfilterSerial(Filter filter, const uint8_t* in, const uint8_t* up, uint8_t* out, size_t bytes) {
  if (filter == kSub) UnfilterPixels<kBpp>(in, up, out, bytes, PredictLeft);
  if (filter == kAverage) UnfilterPixels<kBpp>(in, up, out, bytes, PredictAverage);
  if (filter == kPaeth) UnfilterPixels<kBpp>(in, up, out, bytes, PredictPaeth);
}

#else

template <int kBpp>
void UnfilterSerial(Filter filter, const uint8_t* in, const uint8_t* up, uint8_t* out, size_t bytes) {
  UnfilterPlainly<kBpp>(filter, in, up, out, bytes);
}

#endif

void Unfilter(Filter filter, int bpp, const uint8_t* in, const uint8_t* up, uint8_t* out, size_t bytes) {
  if (filter == kNone) {
    std::memcpy(out, in, bytes);
  } else if (filter == kUp) {
    UnfilterUp(in, up, out, bytes);
  } else if (bpp == 1) {
    UnfilterPlainly<1>(filter, in, up, out, bytes);
  } else if (bpp == 3) {
    UnfilterSerial<3>(filter, in, up, out, bytes);
  } else {
    UnfilterSerial<4>(filter, in, up, out, bytes);
  }
}

// Memory that a thread keeps from image to image: fresh pages cost as much as unfiltering into them.
std::span<uint8_t> Scratch(size_t bytes) {
  constexpr size_t kMostKept = size_t{64} << 20;
  thread_local std::vector<uint8_t> scratch;
  if (scratch.size() < bytes || scratch.size() > std::max(bytes, kMostKept)) {
    scratch.clear();
    scratch.shrink_to_fit();
    scratch.resize(bytes);
  }
  return {scratch.data(), bytes};
}

// Rows of `bpp` bytes a pixel, each behind its filter type, to an image of the same channels.
ImageU8 UnfilterImage(const fs::path& path, std::span<const uint8_t> rows, int width, int height, int bpp) {
  ImageU8 image(width, height, bpp);
  const size_t bytes = static_cast<size_t>(width) * bpp;
  const std::vector<uint8_t> above_first(bytes + 4);
  const uint8_t* up = above_first.data();
  for (int y = 0; y < height; ++y) {
    const uint8_t* in = rows.data() + static_cast<size_t>(y) * (bytes + 1);
    if (in[0] >= kFilterCount) throw FileError(path, fmt::format("is a damaged PNG: row {} has filter {}", y, in[0]));
    Unfilter(static_cast<Filter>(in[0]), bpp, in + 1, up, image.row(y), bytes);
    up = image.row(y);
  }
  return image;
}

// Grey to RGB or RGBA, RGB to RGBA.
ImageU8 Widen(const ImageU8& image, int channels) {
  ImageU8 wide(image.width(), image.height(), channels, 255);
  const int given = image.channels();
  const size_t pixels = image.values().size() / static_cast<size_t>(given);
  const uint8_t* in = image.values().data();
  uint8_t* out = wide.values().data();
  for (size_t i = 0; i < pixels; ++i) {
    for (int c = 0; c < 3; ++c) out[i * channels + c] = in[i * given + (given == 1 ? 0 : c)];
  }
  return wide;
}

// The sum of the filtered bytes as signed magnitudes: small sums deflate well (the PNG specification's heuristic).
void FilterRow(Filter filter, int bpp, const uint8_t* row, const uint8_t* up, uint8_t* out, size_t bytes) {
  const auto width = static_cast<size_t>(bpp);
  const auto predict = [&](size_t i, int left, int corner) {
    return filter == kNone      ? 0
           : filter == kSub     ? left
           : filter == kUp      ? up[i]
           : filter == kAverage ? (left + up[i]) / 2
                                : Paeth(left, up[i], corner);
  };
  for (size_t i = 0; i < std::min(width, bytes); ++i) out[i] = static_cast<uint8_t>(row[i] - predict(i, 0, 0));
  for (size_t i = width; i < bytes; ++i) {
    out[i] = static_cast<uint8_t>(row[i] - predict(i, row[i - width], up[i - width]));
  }
}

int64_t Magnitude(const uint8_t* row, size_t bytes) {
  int64_t sum = 0;
  for (size_t i = 0; i < bytes; ++i) sum += row[i] < 128 ? row[i] : 256 - row[i];
  return sum;
}

void AppendChunk(std::string* file, std::string_view name, std::string_view data) {
  AppendU32(file, static_cast<uint32_t>(data.size()));
  const size_t begin = file->size();
  *file += name;
  *file += data;
  AppendU32(file, libdeflate_crc32(0, file->data() + begin, file->size() - begin));
}

using Decompressor = std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)>;
using Compressor = std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)>;

}  // namespace

bool IsPng(std::string_view bytes) { return bytes.starts_with(kSignature); }

PngHeader ReadPngHeader(const fs::path& path_for_errors, std::string_view bytes) {
  if (!IsPng(bytes)) throw FileError(path_for_errors, "is no PNG");
  std::string_view rest = bytes.substr(kSignature.size());
  const Chunk chunk = TakeCriticalChunk(path_for_errors, &rest);
  if (chunk.name != "IHDR" || chunk.data.size() != kHeaderBytes) {
    throw FileError(path_for_errors, "is a damaged PNG: it does not begin with a header");
  }
  return {ReadU32(chunk.data), ReadU32(chunk.data.substr(4)), chunk.data[8], chunk.data[9], chunk.data[12] != 0};
}

std::optional<ImageU8> DecodeCommonPng(const fs::path& path_for_errors, std::string_view bytes, int channels) {
  const PngHeader header = ReadPngHeader(path_for_errors, bytes);
  const int stored = header.colour_type == 0 ? 1 : header.colour_type == 2 ? 3 : header.colour_type == 6 ? 4 : 0;
  if (stored == 0 || stored > channels || header.bit_depth != 8 || header.interlaced) return std::nullopt;

  std::string_view rest = bytes.substr(kSignature.size() + kAroundChunk + kHeaderBytes);
  std::string_view stream;
  std::string joined;  // only when the stream is in several chunks
  while (true) {
    const Chunk chunk = TakeCriticalChunk(path_for_errors, &rest);
    if (chunk.name == "IEND") break;
    if (chunk.name == "tRNS" || chunk.name == "iCCP") return std::nullopt;
    if (chunk.name == "gAMA" && (chunk.data.size() != 4 || ReadU32(chunk.data) != kSrgbGamma)) return std::nullopt;
    if (chunk.name != "IDAT") continue;
    if (joined.empty() && stream.empty()) {
      stream = chunk.data;
    } else {
      if (joined.empty()) joined = stream;
      joined += chunk.data;
    }
  }
  if (!joined.empty()) stream = joined;

  const auto width = static_cast<int>(header.width), height = static_cast<int>(header.height);
  const size_t size = (static_cast<size_t>(width) * stored + 1) * height;
  // Deflate cannot expand by more than 1032.
  if (size / 1040 > stream.size()) {
    throw FileError(path_for_errors, fmt::format("claims {} x {} pixels but holds only {} bytes of them: cut off or "
                                                 "damaged",
                                                 width, height, stream.size()));
  }
  const std::span<uint8_t> rows = Scratch(size + 4);
  const Decompressor decompressor(libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
  size_t used = 0;
  const libdeflate_result result = libdeflate_zlib_decompress_ex(decompressor.get(), stream.data(), stream.size(),
                                                                 rows.data(), size, &used, nullptr);
  if (result != LIBDEFLATE_SUCCESS) {
    throw FileError(path_for_errors, fmt::format("is a damaged PNG: its pixels {}",
                                                 result == LIBDEFLATE_INSUFFICIENT_SPACE ? "are too many"
                                                 : result == LIBDEFLATE_SHORT_OUTPUT     ? "are too few"
                                                                                         : "cannot be inflated"));
  }
  ImageU8 image = UnfilterImage(path_for_errors, rows, width, height, stored);
  return stored == channels ? std::move(image) : Widen(image, channels);
}

std::string EncodePng(const ImageU8& image, int compression) {
  LIKENESS_CHECK(!image.empty() && image.channels() != 2 && image.channels() <= 4);
  LIKENESS_CHECK(compression >= 0 && compression <= 9);
  const int bpp = image.channels();
  const size_t bytes = static_cast<size_t>(image.width()) * bpp;
  const size_t size = (bytes + 1) * image.height();
  const Compressor compressor(libdeflate_alloc_compressor(compression), &libdeflate_free_compressor);
  const size_t bound = libdeflate_zlib_compress_bound(compressor.get(), size);
  const std::span<uint8_t> scratch = Scratch(size + bytes + bound);
  uint8_t* const rows = scratch.data();
  uint8_t* const trial = rows + size;

  const std::vector<uint8_t> above_first(bytes);
  const uint8_t* up = above_first.data();
  for (int y = 0; y < image.height(); ++y) {
    uint8_t* out = rows + static_cast<size_t>(y) * (bytes + 1);
    out[0] = kUp;  // as good as any single filter, and the quickest to undo
    FilterRow(kUp, bpp, image.row(y), up, out + 1, bytes);
    if (compression > 1) {
      int64_t least = Magnitude(out + 1, bytes);
      for (const Filter filter : {kNone, kSub, kAverage, kPaeth}) {
        FilterRow(filter, bpp, image.row(y), up, trial, bytes);
        const int64_t magnitude = Magnitude(trial, bytes);
        if (magnitude >= least) continue;
        least = magnitude;
        out[0] = filter;
        std::memcpy(out + 1, trial, bytes);
      }
    }
    up = image.row(y);
  }
  uint8_t* const packed = trial + bytes;
  const size_t packed_size = libdeflate_zlib_compress(compressor.get(), rows, size, packed, bound);
  LIKENESS_CHECK(packed_size > 0);

  std::string header;
  AppendU32(&header, static_cast<uint32_t>(image.width()));
  AppendU32(&header, static_cast<uint32_t>(image.height()));
  header += '\x08';
  header += bpp == 1 ? '\0' : bpp == 3 ? '\2' : '\6';
  header += std::string(3, '\0');
  std::string file(kSignature);
  file.reserve(packed_size + 100);
  AppendChunk(&file, "IHDR", header);
  AppendChunk(&file, "IDAT", {reinterpret_cast<const char*>(packed), packed_size});
  AppendChunk(&file, "IEND", "");
  return file;
}

}  // namespace likeness
