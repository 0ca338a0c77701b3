// How long the last frames took, stage by stage.

#pragma once

#include <vector>

namespace likeness {

// Milliseconds. Decoding is done beside the rest, by another thread.
struct FrameTime {
  double decode = 0;     // of the face that is shown
  double upload = 0;     // texture and mesh to the graphics device
  double draw = 0;       // of the face
  double interface = 0;  // of panes
  double total = 0;      // from one frame to the next
};

// A frame at 90 Hz.
inline constexpr double kFrameBudgetMs = 1000 / 90.0;

class FrameTimes {
 public:
  static constexpr int kMost = 240;  // frames that are remembered

  void Add(const FrameTime& time);
  const std::vector<FrameTime>& frames() const { return frames_; }  // from the oldest

  // Of the value that `stage` names, over what is remembered; 0 where nothing is.
  double Median(double FrameTime::*stage) const;
  // Share of the frames whose total is within the budget, 0 ... 1.
  double ShareWithin(double budget_ms) const;

 private:
  std::vector<FrameTime> frames_;
};

}  // namespace likeness
