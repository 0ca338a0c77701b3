#include "likeness/viewer/layout.h"

#include <algorithm>

namespace likeness {
namespace {

constexpr float kControlsWidth = 320;  // points: a slider with its two names
constexpr float kTimelineHeight = 84;  // two rows

}  // namespace

WindowLayout LayOut(float width, float height, float scale, bool controls, bool timeline) {
  // The face keeps at least half of the window, and a pixel.
  const float left = controls ? std::min(kControlsWidth * scale, width / 2) : 0;
  const float bottom = timeline ? std::min(kTimelineHeight * scale, height / 2) : 0;
  WindowLayout layout;
  layout.controls = {0, 0, left, height};
  layout.timeline = {left, height - bottom, width - left, bottom};
  layout.face = {left, 0, std::max(1.0f, width - left), std::max(1.0f, height - bottom)};
  return layout;
}

}  // namespace likeness
