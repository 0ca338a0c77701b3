#include "likeness/viewer/playback.h"

#include <algorithm>
#include <cmath>

namespace likeness {

int FrameAt(const Performance& performance, double time_s) {
  const std::vector<double>& seconds = performance.seconds;
  const auto after = std::lower_bound(seconds.begin(), seconds.end(), time_s);
  if (after == seconds.begin()) return 0;
  const auto before = after - 1;
  const bool nearer_after = after != seconds.end() && *after - time_s <= time_s - *before;
  return static_cast<int>((nearer_after ? after : before) - seconds.begin());
}

void Playback::Advance(double elapsed_s, double duration_s) {
  if (!playing) return;
  time_s += speed * elapsed_s;
  if (time_s <= duration_s) return;
  if (loop && duration_s > 0) {
    time_s = std::fmod(time_s, duration_s);
  } else {
    time_s = duration_s;
    playing = false;
  }
}

void Playback::Step(const Performance& performance, int frames) {
  playing = false;
  const int count = performance.frame_count(), frame = FrameAt(performance, time_s) + frames;
  const int wanted = loop ? (frame % count + count) % count : std::clamp(frame, 0, count - 1);
  time_s = performance.seconds[static_cast<size_t>(wanted)];
}

}  // namespace likeness
