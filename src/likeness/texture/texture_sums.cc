#include "likeness/texture/texture_sums.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "likeness/base/error.h"

namespace likeness {
namespace {

// Gives texels with weight 0 a colour: pull-push over a pyramid whose coarser levels are weighted means of four and
// interpolate linearly on the way back.
void FillGaps(ImageF* colours, ImageF* weights) {
  const int size = colours->width();
  if (size <= 1) return;
  const int half = (size + 1) / 2;
  ImageF coarse_colours(half, half, 3), coarse_weights(half, half, 1);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const float weight = *weights->at(x, y);
      *coarse_weights.at(x / 2, y / 2) += weight;
      for (int c = 0; c < 3; ++c) coarse_colours.at(x / 2, y / 2)[c] += weight * colours->at(x, y)[c];
    }
  }
  for (int y = 0; y < half; ++y) {
    for (int x = 0; x < half; ++x) {
      float& weight = *coarse_weights.at(x, y);
      if (weight == 0) continue;
      for (int c = 0; c < 3; ++c) coarse_colours.at(x, y)[c] /= weight;
      weight = 1;
    }
  }
  FillGaps(&coarse_colours, &coarse_weights);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      if (*weights->at(x, y) != 0) continue;
      // The texel's square and the nearest ones beside, below or above, and diagonally.
      const int x0 = x / 2, x1 = std::clamp(x0 + (x % 2 != 0 ? 1 : -1), 0, half - 1);
      const int y0 = y / 2, y1 = std::clamp(y0 + (y % 2 != 0 ? 1 : -1), 0, half - 1);
      for (int c = 0; c < 3; ++c) {
        colours->at(x, y)[c] = 0.5625f * coarse_colours.at(x0, y0)[c] + 0.1875f * coarse_colours.at(x1, y0)[c] +
                               0.1875f * coarse_colours.at(x0, y1)[c] + 0.0625f * coarse_colours.at(x1, y1)[c];
      }
    }
  }
}

constexpr std::string_view kMagic = "likeness texture sums 1\n";
static_assert(std::endian::native == std::endian::little);

template <typename T>
void Append(std::string* bytes, const T* values, size_t count) {
  bytes->append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

template <typename T>
void Take(std::string_view* bytes, T* values, size_t count) {
  std::memcpy(values, bytes->data(), count * sizeof(T));
  bytes->remove_prefix(count * sizeof(T));
}

}  // namespace

TextureSums::TextureSums(int size)
    : size_(size), colours_(3 * static_cast<size_t>(size) * size), counts_(static_cast<size_t>(size) * size) {}

void TextureSums::Add(const UnwrappedView& view) {
  LIKENESS_CHECK(view.texture.width() == size_ && view.texture.height() == size_ && view.texture.channels() == 3);
  LIKENESS_CHECK(view.mask.width() == size_ && view.mask.height() == size_ && view.mask.channels() == 1);
  const uint8_t* texture = view.texture.values().data();
  const uint8_t* mask = view.mask.values().data();
  for (size_t i = 0; i < counts_.size(); ++i) {
    const uint32_t seen = mask[i] != 0 ? 1 : 0;
    counts_[i] += seen;
    uint32_t squares = 0;
    for (size_t c = 3 * i; c < 3 * i + 3; ++c) {
      const uint32_t value = seen * texture[c];
      colours_[c] += value;
      squares += value * value;
    }
    squares_ += squares;
  }
  ++views_;
}

void TextureSums::Add(const TextureSums& other) {
  LIKENESS_CHECK(size_ == other.size_);
  for (size_t i = 0; i < colours_.size(); ++i) colours_[i] += other.colours_[i];
  for (size_t i = 0; i < counts_.size(); ++i) counts_[i] += other.counts_[i];
  squares_ += other.squares_;
  views_ += other.views_;
}

ImageU8 TextureSums::Average() const {
  ImageU8 average(size_, size_, 3);
  const auto values = average.values();
  for (size_t i = 0; i < values.size(); ++i) {
    const uint32_t count = counts_[i / 3];
    if (count > 0) values[i] = static_cast<uint8_t>((colours_[i] + count / 2) / count);
  }
  return average;
}

ImageU8 TextureSums::FilledAverage() const {
  const ImageU8 average = Average();
  ImageF colours(size_, size_, 3), weights(size_, size_, 1);
  std::copy(average.values().begin(), average.values().end(), colours.values().begin());
  std::transform(counts_.begin(), counts_.end(), weights.values().begin(),
                 [](uint32_t n) { return n > 0 ? 1.f : 0.f; });
  FillGaps(&colours, &weights);
  ImageU8 filled(size_, size_, 3);
  std::transform(colours.values().begin(), colours.values().end(), filled.values().begin(),
                 [](float v) { return static_cast<uint8_t>(std::lround(v)); });
  return filled;
}

double TextureSums::Variance() const {
  double of_means = 0, count = 0;
  for (size_t i = 0; i < colours_.size(); ++i) {
    const uint32_t n = counts_[i / 3];
    if (n == 0) continue;
    of_means += static_cast<double>(colours_[i]) * colours_[i] / n;
    count += n;
  }
  return count > 0 ? std::max(0.0, static_cast<double>(squares_) - of_means) / count : 0;
}

std::string TextureSums::Bytes() const {
  std::string bytes(kMagic);
  Append(&bytes, &views_, 1);
  Append(&bytes, &squares_, 1);
  Append(&bytes, counts_.data(), counts_.size());
  Append(&bytes, colours_.data(), colours_.size());
  return bytes;
}

TextureSums TextureSums::Parse(const std::filesystem::path& path_for_errors, std::string_view bytes, int size) {
  TextureSums sums(size);
  const size_t expected = kMagic.size() + 16 + 4 * (sums.counts_.size() + sums.colours_.size());
  if (bytes.size() != expected || !bytes.starts_with(kMagic)) {
    throw FileError(path_for_errors, fmt::format("is no sum of textures of {} x {} texels", size, size));
  }
  bytes.remove_prefix(kMagic.size());
  Take(&bytes, &sums.views_, 1);
  Take(&bytes, &sums.squares_, 1);
  Take(&bytes, sums.counts_.data(), sums.counts_.size());
  Take(&bytes, sums.colours_.data(), sums.colours_.size());
  bool sound = sums.views_ >= 0;
  uint64_t of_colours = 0;
  for (size_t i = 0; i < sums.colours_.size(); ++i) {
    const uint64_t count = sums.counts_[i / 3], colour = sums.colours_[i];
    sound = sound && count <= static_cast<uint64_t>(sums.views_) && colour <= 255 * count;
    of_colours += colour;
  }
  if (!sound || sums.squares_ < of_colours || sums.squares_ > 255 * of_colours) {
    throw FileError(path_for_errors, "is damaged: its sums do not fit its counts");
  }
  return sums;
}

void VertexSums::Add(const Vertices& vertices) {
  if (frames_ == 0) {
    first_ = vertices;
    sums_ = squares_ = Eigen::ArrayXd::Zero(vertices.size());
  }
  LIKENESS_CHECK(vertices.rows() == first_.rows());
  const Eigen::Map<const Eigen::ArrayXf> now(vertices.data(), vertices.size()), then(first_.data(), first_.size());
  const Eigen::ArrayXd distance = now.cast<double>() - then.cast<double>();
  sums_ += distance;
  squares_ += distance.square();
  ++frames_;
}

std::vector<float> VertexSums::Mean() const {
  LIKENESS_CHECK(frames_ > 0);
  std::vector<float> mean(static_cast<size_t>(first_.size()));
  for (size_t i = 0; i < mean.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    mean[i] = static_cast<float>(first_.data()[i] + sums_[at] / static_cast<double>(frames_));
  }
  return mean;
}

double VertexSums::Variance() const {
  LIKENESS_CHECK(frames_ > 0);
  const auto n = static_cast<double>(frames_);
  return std::max(0.0, (squares_ - sums_.square() / n).sum() / (n * static_cast<double>(first_.size())));
}

}  // namespace likeness
