// What can be played, and the moment of it that is shown.

#pragma once

#include <string>

#include "likeness/avatar/performance.h"

namespace likeness {

// A segment of the frames that an avatar was trained on, or a performance's file.
struct Clip {
  std::string name;
  Performance performance;

  double DurationS() const { return performance.seconds.back(); }
};

// The frame nearest to a time.
int FrameAt(const Performance& performance, double time_s);

struct Playback {
  bool playing = false;
  bool loop = true;
  double speed = 1;  // of the clip's own time
  double time_s = 0;

  // So much time has passed. At the clip's end it begins again, or stops there.
  void Advance(double elapsed_s, double duration_s);
  // Goes to the frame so many frames on, and stops there. Around the end with `loop`.
  void Step(const Performance& performance, int frames);
};

}  // namespace likeness
