#include "likeness/image/resize.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "likeness/base/error.h"

namespace likeness {
namespace {

uint8_t Round(float value) { return static_cast<uint8_t>(std::clamp(value, 0.0f, 255.0f) + 0.5f); }

// One axis: a new sample is the weighted sum of old samples first, first + 1, ...
struct Taps {
  int first = 0;
  std::vector<float> weights;
};

std::vector<Taps> AreaTaps(int old_size, int new_size) {
  std::vector<Taps> taps(new_size);
  const double step = static_cast<double>(old_size) / new_size;
  for (int i = 0; i < new_size; ++i) {
    const double begin = i * step, end = std::min<double>((i + 1) * step, old_size);
    taps[i].first = std::min(static_cast<int>(begin), old_size - 1);
    for (int k = taps[i].first; k < old_size && k < end; ++k) {
      const double covered = std::min<double>(k + 1, end) - std::max<double>(k, begin);
      taps[i].weights.push_back(static_cast<float>(covered / (end - begin)));
    }
  }
  return taps;
}

std::vector<Taps> BilinearTaps(int old_size, int new_size) {
  std::vector<Taps> taps(new_size);
  for (int i = 0; i < new_size; ++i) {
    const double at = std::clamp((i + 0.5) * old_size / new_size - 0.5, 0.0, old_size - 1.0);
    taps[i].first = std::min(static_cast<int>(at), std::max(0, old_size - 2));
    const auto fraction = static_cast<float>(at - taps[i].first);
    taps[i].weights = {1 - fraction};
    if (old_size > 1) taps[i].weights.push_back(fraction);
  }
  return taps;
}

ImageU8 Resample(const ImageU8& image, const std::vector<Taps>& columns, const std::vector<Taps>& rows) {
  const int channels = image.channels();
  ImageF across(static_cast<int>(columns.size()), image.height(), channels);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < across.width(); ++x) {
      const Taps& taps = columns[x];
      for (size_t k = 0; k < taps.weights.size(); ++k) {
        const uint8_t* from = image.at(taps.first + static_cast<int>(k), y);
        for (int c = 0; c < channels; ++c) across.at(x, y)[c] += taps.weights[k] * static_cast<float>(from[c]);
      }
    }
  }
  ImageU8 result(across.width(), static_cast<int>(rows.size()), channels);
  std::vector<float> sum(static_cast<size_t>(across.width()) * channels);
  for (int y = 0; y < result.height(); ++y) {
    std::fill(sum.begin(), sum.end(), 0.0f);
    const Taps& taps = rows[y];
    for (size_t k = 0; k < taps.weights.size(); ++k) {
      const float* from = across.row(taps.first + static_cast<int>(k));
      for (size_t i = 0; i < sum.size(); ++i) sum[i] += taps.weights[k] * from[i];
    }
    std::transform(sum.begin(), sum.end(), result.row(y), Round);
  }
  return result;
}

}  // namespace

ImageU8 ResizeArea(const ImageU8& image, int width, int height) {
  LIKENESS_CHECK(!image.empty() && width > 0 && height > 0);
  return Resample(image, AreaTaps(image.width(), width), AreaTaps(image.height(), height));
}

ImageU8 ResizeBilinear(const ImageU8& image, int width, int height) {
  LIKENESS_CHECK(!image.empty() && width > 0 && height > 0);
  return Resample(image, BilinearTaps(image.width(), width), BilinearTaps(image.height(), height));
}

ImageU8 FitInto(const ImageU8& image, int width, int height) {
  const double scale =
      std::min(static_cast<double>(width) / image.width(), static_cast<double>(height) / image.height());
  const int new_width = std::max(1, static_cast<int>(std::lround(scale * image.width())));
  const int new_height = std::max(1, static_cast<int>(std::lround(scale * image.height())));
  return scale < 1 ? ResizeArea(image, new_width, new_height) : ResizeBilinear(image, new_width, new_height);
}

ImageU8 ToU8(const ImageF& image) {
  if (image.empty()) return {};
  ImageU8 result(image.width(), image.height(), image.channels());
  std::transform(image.values().begin(), image.values().end(), result.values().begin(), Round);
  return result;
}

ImageF ToFloat(const ImageU8& image) {
  if (image.empty()) return {};
  ImageF result(image.width(), image.height(), image.channels());
  std::copy(image.values().begin(), image.values().end(), result.values().begin());
  return result;
}

}  // namespace likeness
