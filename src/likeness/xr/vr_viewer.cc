#include "likeness/xr/vr_viewer.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "likeness/base/error.h"
#include "likeness/base/interrupt.h"
#include "likeness/base/log.h"
#include "likeness/viewer/keys.h"

namespace likeness {
namespace {

using std::chrono::milliseconds;

constexpr double kIdleWaitS = 0.05;              // while there are no frames
constexpr milliseconds kBetweenTries(1000);      // to find a headset again
constexpr milliseconds kTimeToEnd(2000);         // for the runtime to agree
constexpr milliseconds kTimeForFirstFace(5000);  // with cold caches
constexpr double kShareToWait = 0.5;             // of a period, for the face; the rest is for drawing
constexpr double kMostStepS = 0.25;              // of playing: after a rest nothing jumps
constexpr double kNearestMm = 300, kFarthestMm = 10000;

WindowOptions MirrorFor(const VrOptions& options) {
  options.Check();
  WindowOptions window = options.viewer.window;
  window.title = "Likeness: what the left eye sees";
  if (options.viewer.size) {
    window.place.width = (*options.viewer.size)[0];
    window.place.height = (*options.viewer.size)[1];
  }
  return window;
}

ViewState Opened(const ViewerOptions& options) {
  ViewState state = options.state;
  state.Show(std::make_shared<const ViewedAvatar>(OpenAvatar(options.avatar, options.person)));
  if (options.opened) options.opened(&state);
  return state;
}

double MsSince(std::chrono::steady_clock::time_point from) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - from).count();
}

}  // namespace

void VrOptions::Check() const {
  viewer.Check();
  if (viewer.avatar.empty()) throw Error("a headset shows an avatar; name its file or the folder of its training run");
  if (!(distance_mm >= kNearestMm && distance_mm <= kFarthestMm)) {
    throw Error("the avatar stands {} to {} mm away, not {}", kNearestMm, kFarthestMm, distance_mm);
  }
}

VrViewer::VrViewer(const VrOptions& options)
    : options_(options),
      window_(MirrorFor(options)),
      gl_(Window::FunctionAddress, 3, 3),
      state_(Opened(options.viewer)),
      face_(gl_, state_.avatar),
      menu_(gl_) {
  glfwSwapInterval(0);  // the headset's clock is the only one to wait for
  Connect();
}

bool VrViewer::Frame() {
  const bool running = phase() == VrSession::Phase::kRunning;
  Listen(window_.BeginFrame(running ? 0 : kIdleWaitS));
  try {
    if (session_) RunSession();
  } catch (const HeadsetLost& lost) {
    Disconnect(lost.what());
  }
  if (!session_ && !over_ && Clock::now() >= next_try_) {
    try {
      Connect();
    } catch (const std::runtime_error& error) {  // as long as there is none: the user may be connecting it
      Disconnect(error.what());
    }
  }
  if (Clock::now() >= give_up_) over_ = true;
  DrawMirror();
  return !over_;
}

void VrViewer::Listen(const WindowInput& input) {
  for (const int key : input.keys) {
    if (key == 'r') bring_here_ = true;
    PressKey(key, &state_);
  }
  if ((window_.Closing() || state_.wishes.quit) && give_up_ == Clock::time_point::max()) Quit();
}

void VrViewer::Quit() {
  give_up_ = Clock::now();
  if (phase() != VrSession::Phase::kRunning) return;
  give_up_ += kTimeToEnd;
  try {
    session_->AskToEnd();
  } catch (const HeadsetLost&) {
    give_up_ = Clock::now();
  }
}

void VrViewer::Connect() {
  runtime_.emplace();
  session_.emplace(*runtime_, gl_, Window::FunctionAddress);
  for (const size_t eye : {kLeft, kRight}) {
    canvases_[eye].emplace(gl_, session_->width(eye), session_->height(eye), options_.viewer.samples);
  }
  bring_here_ = true;
  LogInfo("a headset by {}: {} x {} pixels an eye", runtime_->name(), session_->width(kLeft), session_->height(kLeft));
}

void VrViewer::Disconnect(const std::string& why) {
  session_.reset();
  runtime_.reset();
  status_ = "Looking for the headset: " + why;
  next_try_ = Clock::now() + kBetweenTries;
}

void VrViewer::RunSession() {
  switch (session_->TakeEvents()) {
    case VrSession::Phase::kLost:
      LogWarning("the headset has gone; looking for it");
      Disconnect("it has gone");
      return;
    case VrSession::Phase::kOver:
      over_ = true;
      return;
    case VrSession::Phase::kIdle:
      status_ = "Put the headset on";
      last_display_ = 0;
      pacing_.Pause();
      return;
    case VrSession::Phase::kRunning:
      break;
  }
  const VrFrame frame = session_->BeginFrame();
  const Clock::time_point began = Clock::now();
  PassTime(frame);
  const bool drawn = frame.visible && frame.located && DrawEyes(frame, began);
  session_->EndFrame(frame, drawn);
  // Of frames that nobody sees the runtime may hand out fewer.
  if (!frame.visible) pacing_.Pause();
  if (drawn) pacing_.Add(frame.display_time, frame.period, MsSince(began), !face_.current());
  status_ =
      fmt::format("{} · {} · Space: play or pause · R: bring it here · Q: quit", runtime_->name(), state_.FrameName());
}

void VrViewer::PassTime(const VrFrame& frame) {
  const double since_last = static_cast<double>(frame.display_time - last_display_) * 1e-9;
  const double elapsed_s = last_display_ != 0 ? std::clamp(since_last, 0.0, kMostStepS) : 0;
  last_display_ = frame.display_time;
  if (menu_.Update(frame.hands, elapsed_s, &state_) || frame.recentred) bring_here_ = true;
  if (bring_here_ && frame.located) {
    local_from_world_ = PlaceBefore(frame.local_from_viewer, options_.distance_mm, state_.orbit.target_in_head);
    bring_here_ = false;
  }
  const Clip* clip = state_.CurrentClip();
  if (clip != nullptr) state_.playback.Advance(elapsed_s, clip->DurationS());
}

bool VrViewer::DrawEyes(const VrFrame& frame, Clock::time_point began) {
  std::vector<Camera> in_local;
  std::vector<EyeView> in_world;
  for (const size_t eye : {kLeft, kRight}) {
    const XrView& view = frame.eyes[eye];
    in_local.push_back(CameraOfEye(view.pose, view.fov, session_->width(eye), session_->height(eye)));
    in_world.push_back({in_local.back(), 0});
    in_world.back().camera.cam_from_world = in_local.back().cam_from_world * local_from_world_;
  }
  const std::chrono::nanoseconds half_a_period(static_cast<int64_t>(kShareToWait * static_cast<double>(frame.period)));
  face_.Show(RequestFor(state_, in_world), began + (face_.any() ? half_a_period : kTimeForFirstFace));
  if (!face_.any()) return false;
  MeshStyle style;
  style.surface = state_.surface;
  style.exposure = static_cast<float>(std::exp2(state_.exposure_stops));
  for (const size_t eye : {kLeft, kRight}) {
    session_->DrawEye(eye, [&](GLuint framebuffer) {
      GlCanvas& canvas = *canvases_[eye];
      canvas.Begin(state_.background);
      face_.Draw(eye, in_world[eye].camera, HeadPose(state_), style);
      menu_.Draw(in_local[eye]);
      canvas.End();
      canvas.CopyTo(framebuffer, 0, 0);
    });
  }
  return true;
}

void VrViewer::DrawMirror() {
  const int width = window_.width(), height = window_.height();
  gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
  gl_.ClearColor(0, 0, 0, 1);
  gl_.Clear(GL_COLOR_BUFFER_BIT);
  if (session_ && face_.any()) {
    const GlCanvas& eye = *canvases_[kLeft];
    const double scale = std::min(static_cast<double>(width) / eye.width(), static_cast<double>(height) / eye.height());
    const int shown_width = static_cast<int>(scale * eye.width()),
              shown_height = static_cast<int>(scale * eye.height());
    eye.ScaleTo(0, (width - shown_width) / 2, (height - shown_height) / 2, shown_width, shown_height);
  }
  ImGui::SetNextWindowPos(ImVec2(0, 0));
  ImGui::SetNextWindowSize(ImVec2(ImGui::GetIO().DisplaySize.x, 0));
  ImGui::Begin("status", nullptr, ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove);
  ImGui::TextWrapped("%s", status_.c_str());
  ImGui::End();
  window_.DrawInterface();
  window_.Swap();
}

void RunVr(const VrOptions& options) {
  VrViewer viewer(options);
  const InterruptScope interrupt;
  bool asked = false;
  while (viewer.Frame()) {
    if (interrupt.Requested() && !std::exchange(asked, true)) viewer.Quit();
  }
  LogInfo("{}", Describe(viewer.pacing().Summary()));
}

}  // namespace likeness
