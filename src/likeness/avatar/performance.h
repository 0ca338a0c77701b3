// A performance: what an avatar does over time. Codes of frames with head poses and time stamps, in one small file that
// `likeness encode` and `likeness drive` write and that renderer, viewer and exports play. docs/performances.md
// describes the file.
//
// Goals: a safetensors file that any program can write with a few lines of Python; complete enough to be played without
// the capture; it says which avatar its codes belong to. Non-goals: sound, pictures, compression.

#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/avatar/architecture.h"
#include "likeness/avatar/safetensors.h"
#include "likeness/geometry/rigid.h"

namespace likeness {

struct Performance {
  std::string avatar;                      // AvatarId of the avatar that the codes belong to; empty: not known
  std::string person;                      // whose face, by name; empty: the avatar's first person
  int latent = 0;                          // values of a code
  std::vector<NamedCondition> conditions;  // as the avatar has them; none: frames are shown under the avatar's means

  // F frames, at least one.
  std::vector<double> seconds;                  // [F], from 0, strictly rising
  std::vector<float> codes;                     // [F, latent]
  std::vector<float> condition_values;          // [F, values of all conditions], as captured
  std::vector<RigidTransform> world_from_head;  // [F], mm
  std::vector<std::string> frame_names;         // [F] "SEGMENT/FRAME", or none

  int frame_count() const { return static_cast<int>(seconds.size()); }
  std::span<const float> Code(int frame) const;             // [latent]
  std::span<const float> ConditionValues(int frame) const;  // [values], empty where there are no conditions

  // Throws Error unless sizes fit each other, values are finite, time rises from 0, and poses rotate. `what` opens the
  // message.
  void Check(const std::string& what) const;
};

// One instant, between two frames or at one. Before the first and after the last frame: that frame.
struct PerformanceMoment {
  std::vector<float> code;              // [latent]
  std::vector<float> condition_values;  // as FrameConditions has them; empty: the avatar's means
  RigidTransform world_from_head;
};
// Codes, conditions and positions change linearly between frames, rotations at an even angular speed.
PerformanceMoment MomentAt(const Performance& performance, double seconds);

// Throws Error, saying what to do, where the codes are not this avatar's: of another latent size, other conditions, or
// another avatar's where that is known.
//   avatar_id  AvatarId; empty: not known
void CheckBelongs(const Performance& performance, const std::filesystem::path& path_for_errors,
                  const Architecture& architecture, const std::string& avatar_id);

// Writes the file whole or not at all. Throws Error as Check does.
void WritePerformance(const std::filesystem::path& path, const Performance& performance);
// The bytes of such a file.
std::string PerformanceBytes(const Performance& performance);

// Whether a safetensors file says that it holds a performance, be it whole or not.
bool IsPerformance(const SafetensorsFile& file);

// Throws Error naming the file for anything that WritePerformance would not have written.
Performance ReadPerformance(const std::filesystem::path& path);
Performance ParsePerformance(const std::filesystem::path& path_for_errors, std::string bytes);

}  // namespace likeness
