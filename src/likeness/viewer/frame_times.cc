#include "likeness/viewer/frame_times.h"

#include <algorithm>

namespace likeness {

void FrameTimes::Add(const FrameTime& time) {
  if (frames_.size() == kMost) frames_.erase(frames_.begin());
  frames_.push_back(time);
}

double FrameTimes::Median(double FrameTime::*stage) const {
  if (frames_.empty()) return 0;
  std::vector<double> values;
  for (const FrameTime& frame : frames_) values.push_back(frame.*stage);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double FrameTimes::ShareWithin(double budget_ms) const {
  if (frames_.empty()) return 0;
  const auto within =
      std::count_if(frames_.begin(), frames_.end(), [&](const FrameTime& f) { return f.total <= budget_ms; });
  return static_cast<double>(within) / static_cast<double>(frames_.size());
}

}  // namespace likeness
