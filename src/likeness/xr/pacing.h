// Whether frames keep the headset's pace.

#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace likeness {

struct PacingSummary {
  int frames = 0;
  double seconds = 0;                // of display that they cover
  double frames_per_s = 0;           // the headset's own
  int missed = 0;                    // displays that got no frame of ours
  int older_faces = 0;               // frames that showed a face decoded for an earlier one
  double median_ms = 0, p99_ms = 0;  // of a frame's work, from its start to when it was handed over
};

class Pacing {
 public:
  // A frame that is handed over for display at `display_ns`; displays are `period_ns` apart.
  void Add(int64_t display_ns, int64_t period_ns, double work_ms, bool older_face);
  // The headset was not in use: the time until the next frame does not count.
  void Pause() { last_display_ns_ = 0; }

  PacingSummary Summary() const;

 private:
  std::vector<float> work_ms_;
  int64_t last_display_ns_ = 0;  // 0: none that counts
  int64_t period_ns_ = 0, covered_ns_ = 0;
  int missed_ = 0, older_faces_ = 0;
};

// In a line.
std::string Describe(const PacingSummary& summary);

}  // namespace likeness
