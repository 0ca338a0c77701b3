// Images in memory: rows from the top, channels interleaved, no padding.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "likeness/base/error.h"

namespace likeness {

template <typename T>
class Image {
 public:
  Image() = default;
  Image(int width, int height, int channels, T value = T())
      : width_(width), height_(height), channels_(channels), data_(Size(width, height, channels), value) {}

  int width() const { return width_; }
  int height() const { return height_; }
  int channels() const { return channels_; }
  bool empty() const { return data_.empty(); }

  T* at(int x, int y) { return data_.data() + (static_cast<size_t>(y) * width_ + x) * channels_; }
  const T* at(int x, int y) const { return data_.data() + (static_cast<size_t>(y) * width_ + x) * channels_; }
  T* row(int y) { return at(0, y); }
  const T* row(int y) const { return at(0, y); }

  // All values, row by row.
  std::span<T> values() { return data_; }
  std::span<const T> values() const { return data_; }

  bool SameShape(const Image& other) const {
    return width_ == other.width_ && height_ == other.height_ && channels_ == other.channels_;
  }
  bool operator==(const Image&) const = default;

 private:
  static size_t Size(int width, int height, int channels) {
    LIKENESS_CHECK(width >= 0 && height >= 0 && channels > 0);
    return static_cast<size_t>(width) * height * channels;
  }

  int width_ = 0;
  int height_ = 0;
  int channels_ = 0;
  std::vector<T> data_;
};

using ImageU8 = Image<uint8_t>;  // 0 ... 255
using ImageF = Image<float>;

}  // namespace likeness
