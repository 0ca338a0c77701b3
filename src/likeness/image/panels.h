// Pictures side by side, and the squared difference of two as a heat map.

#pragma once

#include <string>
#include <vector>

#include "likeness/image/draw.h"
#include "likeness/image/image.h"

namespace likeness {

struct Panel {
  ImageU8 picture;  // RGB or grey
  std::string label;
};

inline constexpr int kPanelGap = 8;  // px

// One row of pictures with their labels above, on a dark ground, `gap` pixels around each.
ImageU8 SideBySide(const std::vector<Panel>& panels, int gap = kPanelGap);

// Rows under each other, aligned left on a dark ground.
ImageU8 Stacked(const std::vector<ImageU8>& rows);

// Black over violet, red and orange to pale yellow, lighter with every step; t is clamped to 0 ... 1.
Colour HeatColour(float t);

// Heat colours of the mean squared difference over the channels; `full_scale` (0 ... 255, squared) is the brightest.
ImageU8 SquaredDifferenceHeat(const ImageU8& a, const ImageU8& b, float full_scale);

// A bar of the colours with what they mean, from 0 to `full_scale` and more, for beneath a heat map.
ImageU8 HeatLegend(int width, float full_scale);

}  // namespace likeness
