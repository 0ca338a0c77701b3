#include "likeness/capture/frame_times.h"

#include <charconv>
#include <optional>

#include "likeness/base/error.h"

namespace likeness {
namespace {

std::optional<int64_t> NumberOf(const std::string& name) {
  constexpr int64_t kMost = 1'000'000'000;
  int64_t number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  const bool whole = error == std::errc() && end == name.data() + name.size();
  return whole && number >= 0 && number <= kMost ? std::optional(number) : std::nullopt;
}

}  // namespace

std::vector<double> FrameTimes(const std::vector<FrameId>& frames, double frames_per_second) {
  if (!(frames_per_second >= 0.1 && frames_per_second <= 1000)) {
    throw Error("a capture has 0.1 to 1000 frames a second, not {}", frames_per_second);
  }
  std::vector<double> times;
  int64_t at = 0;  // in frames
  for (size_t i = 0; i < frames.size(); ++i) {
    if (i > 0) {
      const auto number = NumberOf(frames[i].frame), previous = NumberOf(frames[i - 1].frame);
      const bool counts = frames[i].segment == frames[i - 1].segment && number && previous && *number > *previous;
      at += counts ? *number - *previous : 1;
    }
    times.push_back(static_cast<double>(at) / frames_per_second);
  }
  return times;
}

}  // namespace likeness
