#include "likeness/texture/texture_set.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/text.h"
#include "likeness/image/image_io.h"

namespace likeness {

namespace fs = std::filesystem;

double ReadVariance(const fs::path& path) { return ParseVariance(path, ReadFile(path, 1 << 12)); }

double ParseVariance(const fs::path& path_for_errors, std::string_view text) {
  TextLines lines(path_for_errors, text);
  double variance = 0;
  if (lines.Next()) variance = lines.Numbers(1)[0];
  // A variance of 0 cannot standardise anything.
  if (!(variance > 0)) throw FileError(path_for_errors, "expected one positive number");
  return variance;
}

TextureSet::TextureSet(const Capture& capture, int size) : capture_(capture), layout_(capture.root()), size_(size) {
  if (Exists(layout_.TextureFolder(size))) return;
  const std::vector<int> sizes = TextureSizes(capture.root());
  throw Error("{}: no textures of {} x {} texels; there are {}; make them: likeness unwrap {} --size {}",
              capture.root().string(), size, size, sizes.empty() ? "none" : fmt::format("{}", fmt::join(sizes, ", ")),
              capture.root().string(), size);
}

bool TextureSet::HasTexture(const FrameId& frame, const std::string& camera) const {
  return Exists(layout_.Texture(frame, camera, size_));
}

ImageU8 TextureSet::ReadTexture(const FrameId& frame, const std::string& camera) const {
  return ReadSquare(layout_.Texture(frame, camera, size_), 3);
}

ImageU8 TextureSet::ReadMask(const FrameId& frame, const std::string& camera) const {
  const fs::path path = layout_.TextureMask(frame, camera, size_);
  if (Exists(path)) return ReadSquare(path, 1);
  return ReadMask(frame, camera, ReadTexture(frame, camera));
}

ImageU8 TextureSet::ReadMask(const FrameId& frame, const std::string& camera, const ImageU8& texture) const {
  const fs::path path = layout_.TextureMask(frame, camera, size_);
  if (Exists(path)) return ReadSquare(path, 1);
  ImageU8 mask(size_, size_, 1);
  const auto texels = texture.values();
  const auto seen = mask.values();
  for (size_t i = 0; i < seen.size(); ++i) {
    seen[i] = (texels[3 * i] | texels[3 * i + 1] | texels[3 * i + 2]) != 0 ? 255 : 0;
  }
  return mask;
}

ImageU8 TextureSet::ReadAverage(const FrameId& frame) const {
  return ReadSquare(layout_.AverageTexture(frame, size_), 3);
}

TextureStatistics TextureSet::ReadStatistics() const {
  const CaptureLayout own(layout_.TextureFolder(size_));
  const CaptureLayout& layout = Exists(own.TextureMean()) ? own : layout_;
  if (!Exists(layout.TextureMean())) {
    throw FileError(layout.TextureMean(), fmt::format("no such file; make it: likeness unwrap {} --size {}",
                                                      capture_.root().string(), size_));
  }
  const ImageU8 mean = ReadSquare(layout.TextureMean(), 3);
  TextureStatistics statistics;
  statistics.mean = ImageF(size_, size_, 3);
  std::copy(mean.values().begin(), mean.values().end(), statistics.mean.values().begin());
  statistics.variance = ReadVariance(layout.TextureVariance());
  statistics.vertex_mean = ReadFloats(layout.VertexMean(), 3 * static_cast<size_t>(capture_.topology().vertex_count));
  statistics.vertex_variance = ReadVariance(layout.VertexVariance());
  return statistics;
}

ImageU8 TextureSet::ReadSquare(const fs::path& path, int channels) const {
  ImageU8 image = ReadImage(path, channels);
  if (image.width() != size_ || image.height() != size_) {
    throw FileError(path,
                    fmt::format("is {} x {} texels; expected {} x {}", image.width(), image.height(), size_, size_));
  }
  return image;
}

}  // namespace likeness
