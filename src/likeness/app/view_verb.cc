// likeness view [AVATAR]

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "likeness/app/command.h"
#include "likeness/app/verbs.h"
#include "likeness/base/error.h"
#include "likeness/image/image_io.h"
#include "likeness/render/portrait.h"
#include "likeness/viewer/viewer.h"
#include "likeness/xr/vr_viewer.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path performance;
  std::string frame;
  std::string view;
  std::string fixed_view;
  std::string sliders;
  std::string surface = "texture";
  std::string theme = "remembered";
  std::vector<std::string> show;
  bool play = false;
  std::string size;
  fs::path screenshot;
  bool vr = false;
  double distance_m = 1;
};

Command Describe(Arguments& a, ViewerOptions& options) {
  Command command("view", "Shows an avatar in a window: from all sides, playing, moved by sliders, in stereo.",
                  "likeness view avatars/demo");
  command.Positional("AVATAR", &options.avatar, "avatar file, or the folder of its training run", false);
  command.Option("performance", &a.performance, "file to play");
  command.Option("play", &a.play, "plays at once");
  command.Option("frame", &a.frame, "SEGMENT/FRAME, or SEGMENT: the training frame to begin with");
  command.Option("identity", &options.person, "which of the avatar's people to show; default: the first");
  command.Option("sliders", &a.sliders, "V,V,...: the first sliders, in standard deviations");
  command.Option("view", &a.view, "AZIMUTH,ELEVATION in degrees: towards the subject's left, and up");
  command.Option("fixed-view", &a.fixed_view,
                 "the same: the texture is decoded for this view, wherever one looks from");
  command.Option("stereo", &options.state.stereo, "both eyes, side by side");
  command.Option("eye-distance", &options.state.eye_distance_mm, "millimetres between the eyes");
  command.Choice("surface", &a.surface, {"texture", "both", "wireframe"}, "what is drawn of the mesh");
  command.Option("exposure", &options.state.exposure_stops, "stops: each doubles the light");
  command.Option("show", &a.show, "a pane: texture, uv, times or help; may be repeated");
  command.Option("controls", &options.state.show_controls, "the panes at the left and below");
  command.Choice("theme", &a.theme, {"remembered", "dark", "light"}, "of the panes");
  command.Option("size", &a.size, "WIDTHxHEIGHT of the window; default: as the last time");
  command.Option("scale", &options.window.scale, "of the panes' letters; 0: the screen's");
  command.Option("samples", &options.samples, "a pixel, for smooth edges");
  command.Option("screenshot", &a.screenshot, "draws one frame of the window into this PNG file and ends");
  command.Option("vr", &a.vr, "before you in a headset, by OpenXR; docs/vr.md");
  command.Option("distance", &a.distance_m, "metres from your eyes to the head, with --vr");
  return command;
}

std::array<int, 2> ParseSize(const std::string& text) {
  std::array<int, 2> size = {};
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size[0]);
  if (width.ec == std::errc() && width.ptr != end && *width.ptr == 'x') {
    const auto height = std::from_chars(width.ptr + 1, end, size[1]);
    if (height.ec == std::errc() && height.ptr == end) return size;
  }
  throw UsageError(fmt::format("--size is WIDTHxHEIGHT, such as 1280x800; not '{}'", text));
}

std::vector<float> ParseSliders(const std::string& text) {
  std::vector<float> sliders;
  const char *at = text.data(), *const end = at + text.size();
  while (at != end) {
    const auto [next, error] = std::from_chars(at, end, sliders.emplace_back());
    const bool parted = next == end || (*next == ',' && next + 1 != end);
    if (error != std::errc() || !parted) {
      throw UsageError(fmt::format("--sliders is V,V,... in standard deviations, such as 1.5,-2; not '{}'", text));
    }
    at = next == end ? end : next + 1;
  }
  return sliders;
}

void ShowPanes(const std::vector<std::string>& names, ViewState* state) {
  for (const std::string& name : names) {
    bool* const pane = name == "texture" ? &state->show_texture
                       : name == "uv"    ? &state->show_uvs
                       : name == "times" ? &state->show_timing
                       : name == "help"  ? &state->show_help
                                         : nullptr;
    if (pane == nullptr) throw UsageError(fmt::format("--show is texture, uv, times or help; not '{}'", name));
    *pane = true;
  }
}

// What can be set only when the avatar is there.
void Prepare(const Arguments& a, const std::vector<float>& sliders, ViewState* state) {
  if (!a.view.empty()) ParseView(a.view, &state->orbit.azimuth_deg, &state->orbit.elevation_deg);
  if (!a.frame.empty()) state->GoTo(a.frame);
  if (!a.performance.empty()) {
    state->performances.push_back(OpenPerformance(a.performance, *state->avatar));
    state->PlayClip(state->ClipCount() - 1);
  }
  if (sliders.size() > state->sliders.size()) {
    throw Error("--sliders has {} values; this avatar has {} directions", sliders.size(), state->sliders.size());
  }
  std::copy(sliders.begin(), sliders.end(), state->sliders.begin());
  state->playback.playing = false;
  if (a.play) state->PlayOrPause();
}

}  // namespace

int RunView(int argc, const char* const* argv) {
  Arguments a;
  ViewerOptions options;
  Command command = Describe(a, options);
  if (!command.Parse(argc, argv)) return 0;
  ViewState& state = options.state;
  state.surface = a.surface == "texture" ? MeshFill::kTexture
                  : a.surface == "both"  ? MeshFill::kTextureAndLines
                                         : MeshFill::kLines;
  if (!a.fixed_view.empty()) {
    state.view_dependent = false;
    ParseView(a.fixed_view, &state.fixed_azimuth_deg, &state.fixed_elevation_deg);
  }
  if (a.theme != "remembered") options.dark = a.theme == "dark";
  if (!a.size.empty()) options.size = ParseSize(a.size);
  ShowPanes(a.show, &state);
  if (double unused = 0; !a.view.empty()) ParseView(a.view, &unused, &unused);
  options.opened = [&a, sliders = ParseSliders(a.sliders)](ViewState* opened) { Prepare(a, sliders, opened); };
  if (a.vr) {
    if (options.avatar.empty()) throw UsageError("--vr needs an avatar: likeness view AVATAR --vr");
    if (!(a.distance_m >= 0.3 && a.distance_m <= 10)) {
      throw UsageError(fmt::format("--distance is 0.3 to 10 metres, not {}", a.distance_m));
    }
    if (!a.screenshot.empty()) throw UsageError("--screenshot draws the desktop's window: not with --vr");
    RunVr({std::move(options), 1000 * a.distance_m});
  } else if (a.screenshot.empty()) {
    RunViewer(options);
  } else {
    options.window.visible = false;
    WritePng(a.screenshot, DrawViewer(options));
    fmt::print("{}\n", a.screenshot.string());
  }
  return 0;
}

}  // namespace likeness
