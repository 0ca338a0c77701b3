#include "likeness/xr/pacing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "likeness/base/quantile.h"

namespace likeness {

void Pacing::Add(int64_t display_ns, int64_t period_ns, double work_ms, bool older_face) {
  period_ns_ = period_ns;
  if (last_display_ns_ != 0 && period_ns > 0) {
    const int64_t step = display_ns - last_display_ns_;
    covered_ns_ += step;
    const auto periods = std::llround(static_cast<double>(step) / static_cast<double>(period_ns));
    missed_ += static_cast<int>(std::max(periods - 1, 0LL));
  }
  last_display_ns_ = display_ns;
  work_ms_.push_back(static_cast<float>(work_ms));
  older_faces_ += older_face ? 1 : 0;
}

PacingSummary Pacing::Summary() const {
  PacingSummary summary;
  summary.frames = static_cast<int>(work_ms_.size());
  if (summary.frames == 0) return summary;
  summary.seconds = static_cast<double>(covered_ns_) * 1e-9;
  if (period_ns_ > 0) summary.frames_per_s = 1e9 / static_cast<double>(period_ns_);
  summary.missed = missed_;
  summary.older_faces = older_faces_;
  const std::vector<double> work(work_ms_.begin(), work_ms_.end());
  summary.median_ms = Quantile(work, 0.5);
  summary.p99_ms = Quantile(work, 0.99);
  return summary;
}

std::string Describe(const PacingSummary& summary) {
  return fmt::format(
      "{} frames in {:.1f} s of display at {:.0f} Hz, {} missed, {} with an older face; a frame's work: median {:.1f} "
      "ms, 99 % below {:.1f} ms",
      summary.frames, summary.seconds, summary.frames_per_s, summary.missed, summary.older_faces, summary.median_ms,
      summary.p99_ms);
}

}  // namespace likeness
