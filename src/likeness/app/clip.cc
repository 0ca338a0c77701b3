#include "likeness/app/clip.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "likeness/avatar/avatar_id.h"
#include "likeness/avatar/codes.h"
#include "likeness/avatar/performance.h"
#include "likeness/base/error.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

constexpr double kMostSeconds = 3600;

ClipFrame FrameOf(const FrameCode& code) {
  ClipFrame frame;
  frame.code = code.mu;
  frame.conditions = ConditionsOf(code);
  frame.segment = code.segment;
  frame.frame = code.frame;
  return frame;
}

std::vector<ClipFrame> SegmentFrames(const Avatar& avatar, const std::string& segment, int identity) {
  std::vector<ClipFrame> frames;
  std::vector<std::string> names;
  for (const FrameCode& code : avatar.codes) {
    if (code.identity != identity) continue;
    if (names.empty() || names.back() != code.segment) names.push_back(code.segment);
    if (code.segment == segment) frames.push_back(FrameOf(code));
  }
  if (!frames.empty()) return frames;
  const std::string nearest = NearestWord(segment, names);
  throw Error("--segment '{}': the avatar has no codes of it{}; it has {}", segment,
              nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest), fmt::join(names, ", "));
}

std::vector<ClipFrame> PerformanceFrames(const Avatar& avatar, const ClipOptions& options) {
  const Performance performance = ReadPerformance(options.performance);
  CheckBelongs(performance, options.performance, avatar.architecture, AvatarId(avatar));
  const int person = performance.person.empty() ? 0 : FindIdentity(avatar, performance.person);
  const RigidTransform head_from_world = performance.world_from_head.front().Inverse();
  std::vector<ClipFrame> frames;
  const double seconds = std::min(performance.seconds.back(), kMostSeconds);
  for (int i = 0; i / options.frames_per_s <= seconds + 1e-9; ++i) {
    const PerformanceMoment moment = MomentAt(performance, i / options.frames_per_s);
    ClipFrame& frame = frames.emplace_back();
    frame.code = moment.code;
    frame.conditions = {person, moment.condition_values};
    frame.world_from_head = head_from_world * moment.world_from_head;
  }
  return frames;
}

std::vector<ClipFrame> CodeFrames(std::vector<std::vector<float>> codes, int identity) {
  std::vector<ClipFrame> frames(codes.size());
  for (size_t i = 0; i < codes.size(); ++i) {
    frames[i].code = std::move(codes[i]);
    frames[i].conditions.identity = identity;
  }
  return frames;
}

std::vector<ClipFrame> NamedFrame(const Avatar& avatar, const std::string& name, int identity) {
  const NamedCode code = FindCode(avatar, name, identity);
  if (code.frame != nullptr) return {FrameOf(*code.frame)};
  return CodeFrames({code.mu}, identity);
}

std::vector<ClipFrame> PlayedFrames(const Avatar& avatar, const ClipOptions& options, int identity) {
  const int latent = avatar.architecture.latent;
  if (!options.performance.empty()) return PerformanceFrames(avatar, options);
  if (!options.segment.empty()) return SegmentFrames(avatar, options.segment, identity);
  if (!options.codes.empty()) return CodeFrames(ReadCodeSequence(options.codes, latent), identity);
  if (!options.code.empty()) return CodeFrames({ReadCode(options.code, latent)}, identity);
  return NamedFrame(avatar, options.frame, identity);
}

}  // namespace

void ClipOptions::Check() const {
  const int sources = !code.empty() + !codes.empty() + !segment.empty() + !performance.empty() + (frame != "mean");
  if (sources > 1) throw UsageError("of --frame, --code, --codes, --segment and --performance one at most is shown");
  if (!(turntable_s >= 0 && turntable_s <= kMostSeconds)) {
    throw UsageError(fmt::format("--turntable is 0 to {} seconds", kMostSeconds));
  }
  if (!(frames_per_s > 0 && frames_per_s <= 240)) throw UsageError("--fps is more than 0, and at most 240");
}

void AddClipFlags(Command* command, ClipOptions* options) {
  command->Option("frame", &options->frame, "mean, a number from 0, or [PERSON/]SEGMENT/FRAME of a training frame");
  command->Option("code", &options->code, "text file with a latent code, instead of --frame");
  command->Option("codes", &options->codes, "text file with codes one after another, a frame of the video each");
  command->Option("segment", &options->segment, "all training frames of this segment, a frame of the video each");
  command->Option("performance", &options->performance, "performance file to play, with its head's motion");
  command->Option("turntable", &options->turntable_s, "seconds that the camera takes once around; 0: it stands still");
  command->Option("fps", &options->frames_per_s, "frames a second");
  command->Option("identity", &options->identity, "which of the avatar's people to draw; default: whose frame it is");
  command->Option("condition", &options->conditions,
                  "NAME=V,V,...: a named condition, instead of the frame's; may be repeated");
}

std::vector<ClipFrame> MakeClip(const Avatar& avatar, const ClipOptions& options) {
  const int identity = options.identity.empty() ? 0 : FindIdentity(avatar, options.identity);
  std::vector<ClipFrame> frames = PlayedFrames(avatar, options, identity);
  for (ClipFrame& frame : frames) {
    if (!options.identity.empty()) frame.conditions.identity = identity;
    for (const std::string& assignment : options.conditions) SetCondition(avatar, assignment, &frame.conditions);
  }
  if (options.turntable_s == 0) return frames;
  const auto turn = static_cast<size_t>(std::max(1.0, std::round(options.turntable_s * options.frames_per_s)));
  std::vector<ClipFrame> turned;
  for (size_t i = 0; i < turn; ++i) {
    turned.push_back(frames[i % frames.size()]);
    turned.back().azimuth_deg = 360.0 * static_cast<double>(i) / static_cast<double>(turn);
  }
  return turned;
}

}  // namespace likeness
