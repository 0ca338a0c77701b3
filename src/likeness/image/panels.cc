#include "likeness/image/panels.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "likeness/base/error.h"

namespace likeness {
namespace {

constexpr Colour kGround = {24, 26, 30};
constexpr Colour kInk = {222, 225, 230};
constexpr int kLabelHeight = 14;

}  // namespace

ImageU8 SideBySide(const std::vector<Panel>& panels, int gap) {
  LIKENESS_CHECK(!panels.empty());
  int width = gap, height = 0;
  for (const Panel& panel : panels) {
    width += panel.picture.width() + gap;
    height = std::max(height, panel.picture.height());
  }
  ImageU8 row(width, height + kLabelHeight + 2 * gap, 3);
  FillRectangle(&row, 0, 0, row.width(), row.height(), kGround);
  int x = gap;
  for (const Panel& panel : panels) {
    DrawWords(&row, x, gap, ShortenWords(panel.label, panel.picture.width()), kInk);
    Blit(&row, panel.picture, x, gap + kLabelHeight);
    x += panel.picture.width() + gap;
  }
  return row;
}

ImageU8 Stacked(const std::vector<ImageU8>& rows) {
  LIKENESS_CHECK(!rows.empty());
  int width = 0, height = 0;
  for (const ImageU8& row : rows) {
    width = std::max(width, row.width());
    height += row.height();
  }
  ImageU8 picture(width, height, 3);
  FillRectangle(&picture, 0, 0, width, height, kGround);
  int y = 0;
  for (const ImageU8& row : rows) {
    Blit(&picture, row, 0, y);
    y += row.height();
  }
  return picture;
}

Colour HeatColour(float t) {
  static constexpr std::array<Colour, 6> kStops = {
      {{0, 0, 4}, {66, 10, 104}, {147, 38, 103}, {221, 81, 58}, {252, 165, 10}, {252, 255, 164}}};
  const float at = std::clamp(t, 0.0f, 1.0f) * (kStops.size() - 1);
  const auto low = std::min(static_cast<size_t>(at), kStops.size() - 2);
  const float fraction = at - static_cast<float>(low);
  Colour colour;
  for (int c = 0; c < 3; ++c) {
    colour[c] = static_cast<uint8_t>(std::lround(static_cast<float>(kStops[low][c]) * (1 - fraction) +
                                                 static_cast<float>(kStops[low + 1][c]) * fraction));
  }
  return colour;
}

ImageU8 SquaredDifferenceHeat(const ImageU8& a, const ImageU8& b, float full_scale) {
  LIKENESS_CHECK(a.SameShape(b) && full_scale > 0);
  ImageU8 heat(a.width(), a.height(), 3);
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      int sum = 0;
      for (int c = 0; c < a.channels(); ++c) {
        const int difference = int{a.at(x, y)[c]} - int{b.at(x, y)[c]};
        sum += difference * difference;
      }
      const Colour colour = HeatColour(static_cast<float>(sum) / (static_cast<float>(a.channels()) * full_scale));
      std::copy(colour.begin(), colour.end(), heat.at(x, y));
    }
  }
  return heat;
}

ImageU8 HeatLegend(int width, float full_scale) {
  constexpr int kBarHeight = 8, kGap = 4;
  const std::string low = "0", high = fmt::format("{:g} and more", full_scale);
  ImageU8 legend(width, kBarHeight + kGap + kLabelHeight, 3);
  FillRectangle(&legend, 0, 0, width, legend.height(), kGround);
  for (int x = 0; x < width; ++x) {
    FillRectangle(&legend, x, 0, 1, kBarHeight, HeatColour((static_cast<float>(x) + 0.5f) / static_cast<float>(width)));
  }
  DrawWords(&legend, 0, kBarHeight + kGap, low, kInk);
  const std::string shown = ShortenWords(high, width - 2 * WordsWidth(low));
  DrawWords(&legend, width - WordsWidth(shown), kBarHeight + kGap, shown, kInk);
  return legend;
}

}  // namespace likeness
