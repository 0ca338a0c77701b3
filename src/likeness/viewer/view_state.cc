#include "likeness/viewer/view_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "likeness/base/error.h"
#include "likeness/base/random.h"
#include "likeness/base/text.h"
#include "likeness/render/portrait.h"

namespace likeness {
namespace {

// Random faces keep within what training has seen, or they look like nobody.
constexpr double kMostRandomDeviations = 2;

}  // namespace

void ViewState::Show(std::shared_ptr<const ViewedAvatar> opened) {
  avatar = std::move(opened);
  performances.clear();
  clip = -1;
  playback = {};
  ResetFace();
  ResetView();
}

void ViewState::ResetFace() {
  clip = -1;
  playback.playing = false;
  playback.time_s = 0;
  sliders.assign(avatar != nullptr ? avatar->directions.size() : 0, 0.0f);
}

void ViewState::ResetView() {
  if (avatar != nullptr) orbit = OrbitAround(avatar->rest_vertices, avatar->topology);
}

void ViewState::RandomFace(uint64_t seed) {
  ResetFace();
  Random random(seed);
  for (float& slider : sliders) {
    slider = static_cast<float>(std::clamp(random.Normal(), -kMostRandomDeviations, kMostRandomDeviations));
  }
}

void ViewState::GoTo(const std::string& name) {
  std::vector<std::string> known;
  for (int i = 0; i < ClipCount(); ++i) {
    const Performance& performance = ClipAt(i).performance;
    const auto& frames = performance.frame_names;
    const auto found = std::find(frames.begin(), frames.end(), name);
    if (found != frames.end() || name == ClipAt(i).name) {
      const auto frame = found != frames.end() ? found - frames.begin() : 0;
      PlayClip(i);
      playback.playing = false;
      playback.time_s = performance.seconds[static_cast<size_t>(frame)];
      return;
    }
    known.push_back(ClipAt(i).name);
    known.insert(known.end(), frames.begin(), frames.end());
  }
  const std::string nearest = NearestWord(name, known);
  throw Error("there is no frame '{}'{}; expected SEGMENT/FRAME or SEGMENT of a training frame", name,
              nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest));
}

void ViewState::PlayClip(int index) {
  clip = index;
  playback.time_s = 0;
  playback.playing = index >= 0;
}

void ViewState::PlayOrPause() {
  if (clip < 0 && ClipCount() > 0) clip = 0;
  playback.playing = clip >= 0 && !playback.playing;
  const bool at_end = clip >= 0 && playback.time_s >= CurrentClip()->DurationS();
  if (playback.playing && at_end) playback.time_s = 0;
}

void ViewState::ToggleViewDependence() {
  view_dependent = !view_dependent;
  fixed_azimuth_deg = orbit.azimuth_deg;
  fixed_elevation_deg = orbit.elevation_deg;
}

int ViewState::ClipCount() const {
  return static_cast<int>((avatar != nullptr ? avatar->clips.size() : 0) + performances.size());
}

const Clip& ViewState::ClipAt(int index) const {
  LIKENESS_CHECK(index >= 0 && index < ClipCount());
  const auto own = avatar->clips.size(), i = static_cast<size_t>(index);
  return i < own ? avatar->clips[i] : performances[i - own];
}

const Clip* ViewState::CurrentClip() const { return clip < 0 ? nullptr : &ClipAt(clip); }

std::string ViewState::FrameName() const {
  const Clip* current = CurrentClip();
  if (current == nullptr) return "at rest";
  const Performance& performance = current->performance;
  const int frame = FrameAt(performance, playback.time_s);
  const std::string name =
      performance.frame_names.empty() ? current->name : performance.frame_names[static_cast<size_t>(frame)];
  return fmt::format("{} ({} of {})", name, frame + 1, performance.frame_count());
}

RigidTransform HeadPose(const ViewState& state) {
  const Clip* clip = state.CurrentClip();
  if (clip == nullptr || !state.head_moves) return {};
  return clip->performance.world_from_head.front().Inverse() *
         MomentAt(clip->performance, state.playback.time_s).world_from_head;
}

DecodeRequest RequestFor(const ViewState& state, const std::vector<EyeView>& eyes) {
  LIKENESS_CHECK(state.avatar != nullptr && !eyes.empty());
  const Clip* clip = state.CurrentClip();
  DecodeRequest request;
  request.code = MovedCode(
      *state.avatar, clip != nullptr ? MomentAt(clip->performance, state.playback.time_s).code : state.avatar->rest,
      state.sliders);
  if (state.view_dependent) {
    const RigidTransform head = HeadPose(state);
    for (const EyeView& eye : eyes) request.views_in_head.push_back(ViewVector(eye.camera, head).cast<float>());
  } else {
    request.views_in_head.push_back(  // one texture for both eyes
        ViewDirection(state.fixed_azimuth_deg, state.fixed_elevation_deg).cast<float>());
  }
  return request;
}

}  // namespace likeness
