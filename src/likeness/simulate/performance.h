// What a face does over time: named segments of frames, each with expression weights and a head pose.

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "likeness/geometry/rigid.h"
#include "likeness/simulate/head.h"

namespace likeness {

struct PerformanceFrame {
  int number = 0;     // names the frame's files; grows within a performance and may jump
  double time_s = 0;  // since the start
  std::array<float, kExpressionCount> weights = {};
  // Of the head on its neck, radians: yaw to the subject's left, pitch down, roll towards the right shoulder.
  double yaw = 0, pitch = 0, roll = 0;
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();  // of the neck

  // The pose of a head that turns about the top of its neck.
  RigidTransform WorldFromHead() const;
};

struct PerformanceSegment {
  std::string name;  // "EXP_smile"; no held-out segment's name begins a training segment's
  bool held_out = false;
  std::vector<PerformanceFrame> frames;
};

struct SimulatedPerformance {
  std::vector<PerformanceSegment> segments;  // none is empty

  int FrameCount() const;
};

// Head motion of someone who sits: a few degrees and millimetres about the rest pose, smooth in time. The same seed
// gives the same motion.
class HeadMotion {
 public:
  explicit HeadMotion(uint64_t seed);
  // Sets yaw, pitch, roll and shift.
  void Apply(PerformanceFrame* frame) const;

 private:
  struct Wave {
    double amplitude, frequency_hz, phase;
  };
  std::array<std::array<Wave, 3>, 6> waves_;  // yaw, pitch, roll, x, y, z
};

// A performance without a recording, `frames` frames in all (2 or more): peak expressions (segments EXP_*) and
// speech-like motion (SEN_*) with blinks, brows, gaze and head motion. About a fifth of the frames is held out: a
// sentence of its own, and EXP_free_face, mixtures of the expressions. Few frames leave out expressions and sentences.
SimulatedPerformance BuiltInPerformance(int frames, uint64_t seed);

// As much as the paper's capture: always 173 segments, of one frame or more each, so `frames` is 173 or more. 122 peak
// expressions (EXP_*) that go from the neutral face to the peak and back, 50 sentences (SEN_*), and EXP_free_face. Held
// out: the last 10 sentences and EXP_free_face.
SimulatedPerformance FullPerformance(int frames, uint64_t seed);

}  // namespace likeness
