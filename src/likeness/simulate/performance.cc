#include "likeness/simulate/performance.h"

#include <cmath>
#include <numbers>

#include "likeness/base/random.h"

namespace likeness {

RigidTransform PerformanceFrame::WorldFromHead() const {
  const Eigen::Vector3d neck(0, -80, -35);  // in head space, mm
  RigidTransform pose;
  pose.rotation = RotationFromYawPitchRoll(yaw, pitch, roll);
  pose.translation = neck - pose.rotation * neck + shift_mm;
  return pose;
}

int SimulatedPerformance::FrameCount() const {
  int count = 0;
  for (const PerformanceSegment& segment : segments) count += static_cast<int>(segment.frames.size());
  return count;
}

HeadMotion::HeadMotion(uint64_t seed) {
  // Radians and millimetres; three waves add up to less than twice this.
  constexpr std::array<double, 6> kAmplitudes = {0.07, 0.045, 0.03, 3, 2, 3};
  Random random(seed, Hash("head motion"));
  for (size_t axis = 0; axis < waves_.size(); ++axis) {
    for (size_t k = 0; k < 3; ++k) {
      const double frequency = random.Uniform(0.07, 0.13) * std::pow(2.3, static_cast<double>(k));
      waves_[axis][k] = {kAmplitudes[axis] / std::pow(1.8, static_cast<double>(k)), frequency,
                         random.Uniform(0, 2 * std::numbers::pi)};
    }
  }
}

void HeadMotion::Apply(PerformanceFrame* frame) const {
  std::array<double, 6> value = {};
  for (size_t axis = 0; axis < waves_.size(); ++axis) {
    for (const Wave& wave : waves_[axis]) {
      value[axis] += wave.amplitude * std::sin(2 * std::numbers::pi * wave.frequency_hz * frame->time_s + wave.phase);
    }
  }
  frame->yaw = value[0];
  frame->pitch = value[1];
  frame->roll = value[2];
  frame->shift_mm = {value[3], value[4], value[5]};
}

}  // namespace likeness
