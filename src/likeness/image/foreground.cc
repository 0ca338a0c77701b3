#include "likeness/image/foreground.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace likeness {
namespace {

constexpr int kLeastDifference = 10;  // of 255, summed over the channels

int Difference(const uint8_t* a, const std::array<int, 3>& b) {
  return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
}

// Left, right and upper borders: the lower one often shows neck and shoulders.
std::vector<const uint8_t*> BorderPixels(const ImageU8& rgb) {
  std::vector<const uint8_t*> pixels;
  for (int x = 0; x < rgb.width(); ++x) pixels.push_back(rgb.at(x, 0));
  for (int y = 0; y < rgb.height() / 2; ++y) {
    pixels.push_back(rgb.at(0, y));
    pixels.push_back(rgb.at(rgb.width() - 1, y));
  }
  return pixels;
}

// Sets background that does not reach the picture's border, pupils and nostrils, to foreground.
void FillHoles(ImageU8* mask) {
  const int width = mask->width(), height = mask->height();
  ImageU8 outside(width, height, 1);
  std::vector<std::pair<int, int>> open;
  const auto visit = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= width || y >= height || *mask->at(x, y) != 0 || *outside.at(x, y) != 0) return;
    *outside.at(x, y) = 255;
    open.emplace_back(x, y);
  };
  for (int x = 0; x < width; ++x) visit(x, 0), visit(x, height - 1);
  for (int y = 0; y < height; ++y) visit(0, y), visit(width - 1, y);
  while (!open.empty()) {
    const auto [x, y] = open.back();
    open.pop_back();
    visit(x - 1, y), visit(x + 1, y), visit(x, y - 1), visit(x, y + 1);
  }
  for (size_t i = 0; i < mask->values().size(); ++i) mask->values()[i] = outside.values()[i] != 0 ? 0 : 255;
}

// Sums over squares of side 2 radius + 1, the border cut off.
ImageF BoxSums(const ImageF& image, int radius) {
  const int width = image.width(), height = image.height();
  ImageF rows(width, height, 1), sums(width, height, 1);
  // Each line's running sum, in double so that taking away what was added leaves no trace.
  for (int y = 0; y < height; ++y) {
    double sum = 0;
    for (int x = -radius; x < width; ++x) {
      if (x + radius < width) sum += *image.at(x + radius, y);
      if (x - radius - 1 >= 0) sum -= *image.at(x - radius - 1, y);
      if (x >= 0) *rows.at(x, y) = static_cast<float>(sum);
    }
  }
  for (int x = 0; x < width; ++x) {
    double sum = 0;
    for (int y = -radius; y < height; ++y) {
      if (y + radius < height) sum += *rows.at(x, y + radius);
      if (y - radius - 1 >= 0) sum -= *rows.at(x, y - radius - 1);
      if (y >= 0) *sums.at(x, y) = static_cast<float>(sum);
    }
  }
  return sums;
}

}  // namespace

std::optional<ImageU8> FindForeground(const ImageU8& rgb) {
  if (rgb.width() < 8 || rgb.height() < 8) return std::nullopt;
  const std::vector<const uint8_t*> border = BorderPixels(rgb);
  std::array<int, 3> ground;
  for (size_t c = 0; c < 3; ++c) {
    std::vector<uint8_t> values;
    for (const uint8_t* pixel : border) values.push_back(pixel[c]);
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    ground[c] = values[values.size() / 2];
  }
  std::vector<int> spread;
  for (const uint8_t* pixel : border) spread.push_back(Difference(pixel, ground));
  const auto most = spread.begin() + static_cast<std::ptrdiff_t>(spread.size() * 8 / 10);
  std::nth_element(spread.begin(), most, spread.end());
  if (*most > 45) return std::nullopt;
  const int threshold = std::max(kLeastDifference, 2 * *most);

  ImageU8 mask(rgb.width(), rgb.height(), 1);
  int64_t count = 0;
  for (int y = 0; y < rgb.height(); ++y) {
    for (int x = 0; x < rgb.width(); ++x) {
      if (Difference(rgb.at(x, y), ground) <= threshold) continue;
      *mask.at(x, y) = 255;
      ++count;
    }
  }
  const double share = static_cast<double>(count) / (static_cast<double>(rgb.width()) * rgb.height());
  if (share < 0.005 || share > 0.97) return std::nullopt;
  FillHoles(&mask);
  return mask;
}

ImageF LocalContrast(const ImageU8& rgb, const ImageU8& foreground, int radius_px) {
  ImageF luma(rgb.width(), rgb.height(), 1), weight(rgb.width(), rgb.height(), 1, 1.0f);
  for (int y = 0; y < rgb.height(); ++y) {
    for (int x = 0; x < rgb.width(); ++x) {
      const uint8_t* p = rgb.at(x, y);
      if (!foreground.empty() && *foreground.at(x, y) == 0) *weight.at(x, y) = 0;
      *luma.at(x, y) = *weight.at(x, y) * (0.299f * p[0] + 0.587f * p[1] + 0.114f * p[2]);
    }
  }
  const ImageF sums = BoxSums(luma, radius_px), weights = BoxSums(weight, radius_px);
  const ImageF near_sums = BoxSums(luma, 1), near_weights = BoxSums(weight, 1);
  ImageF contrast(rgb.width(), rgb.height(), 1);
  for (size_t i = 0; i < contrast.values().size(); ++i) {
    if (weight.values()[i] == 0) continue;
    const float mean = sums.values()[i] / weights.values()[i], here = near_sums.values()[i] / near_weights.values()[i];
    contrast.values()[i] = (here - mean) / (mean + 8);
  }
  return contrast;
}

MaskOverlap Overlap(const ImageU8& a, const ImageU8& b) {
  LIKENESS_CHECK(a.SameShape(b));
  MaskOverlap overlap;
  for (size_t i = 0; i < a.values().size(); ++i) {
    const bool in_a = a.values()[i] >= 128, in_b = b.values()[i] >= 128;
    overlap.a += in_a;
    overlap.b += in_b;
    overlap.both += in_a && in_b;
  }
  return overlap;
}

}  // namespace likeness
