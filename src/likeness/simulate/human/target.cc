#include "likeness/simulate/human/target.h"

#include <zlib.h>

#include <algorithm>
#include <limits>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

constexpr size_t kMostBytes = size_t{64} << 20;
constexpr double kLargestDelta = 1e6;  // far beyond any head, well inside float

}  // namespace

std::string Gunzip(const std::filesystem::path& path_for_errors, std::string_view bytes, size_t most) {
  z_stream stream = {};
  constexpr int kGzipOnly = 16 + MAX_WBITS;
  if (inflateInit2(&stream, kGzipOnly) != Z_OK) throw FileError(path_for_errors, "zlib does not start");
  const struct Closer {
    z_stream* stream;
    ~Closer() { inflateEnd(stream); }
  } closer{&stream};
  if (bytes.size() > std::numeric_limits<uInt>::max()) throw FileError(path_for_errors, "is too large");
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  std::string text;
  std::vector<char> chunk(size_t{1} << 16);
  int status = Z_OK;
  while (status != Z_STREAM_END) {
    stream.next_out = reinterpret_cast<Bytef*>(chunk.data());
    stream.avail_out = static_cast<uInt>(chunk.size());
    status = inflate(&stream, Z_NO_FLUSH);
    if (status != Z_OK && status != Z_STREAM_END) {
      throw FileError(path_for_errors, "is no whole gzip file (cut off or damaged)");
    }
    const size_t count = chunk.size() - stream.avail_out;
    if (count > most - text.size()) {
      throw FileError(path_for_errors, fmt::format("unpacks to more than {} bytes", most));
    }
    text.append(chunk.data(), count);
  }
  return text;
}

Target ParseTarget(const std::filesystem::path& path_for_errors, std::string_view text, int vertex_count) {
  Target target;
  TextLines lines(path_for_errors, text);
  while (lines.Next()) {
    const std::string_view line = Trim(lines.line());
    if (line.empty() || line.front() == '#') continue;
    const auto words = lines.Words();
    if (words.size() != 4) lines.Fail(fmt::format("expected 'vertex dx dy dz', found {} words", words.size()));
    const int64_t vertex = lines.Integer(words[0]);
    if (vertex < 0 || vertex >= vertex_count) {
      lines.Fail(fmt::format("vertex {} does not exist; the base mesh has {}", vertex, vertex_count));
    }
    Eigen::Vector3f delta;
    for (int axis = 0; axis < 3; ++axis) {
      const double value = lines.Number(words[axis + 1]);
      if (std::abs(value) > kLargestDelta) lines.Fail("a displacement is too large");
      delta[axis] = static_cast<float>(value);
    }
    target.vertices.push_back(static_cast<int>(vertex));
    target.deltas.push_back(delta);
  }
  return target;
}

Target ReadTarget(const std::filesystem::path& path, int vertex_count) {
  std::string bytes = ReadFile(path, kMostBytes);
  if (path.extension() == ".gz") bytes = Gunzip(path, bytes, kMostBytes);
  return ParseTarget(path, bytes, vertex_count);
}

}  // namespace likeness
