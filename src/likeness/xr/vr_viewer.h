// An avatar before somebody who wears a headset, and a window that mirrors the left eye.

#pragma once

#include <array>
#include <chrono>
#include <optional>
#include <string>

#include "likeness/gl/functions.h"
#include "likeness/render/gl/canvas.h"
#include "likeness/viewer/viewer.h"
#include "likeness/viewer/window.h"
#include "likeness/xr/face.h"
#include "likeness/xr/hand_menu.h"
#include "likeness/xr/pacing.h"
#include "likeness/xr/session.h"

namespace likeness {

struct VrOptions {
  ViewerOptions viewer;       // the avatar is named; the window is the mirror
  double distance_mm = 1000;  // from the viewer's eyes to the avatar's middle; 300 ... 10000

  void Check() const;  // throws Error
};

class VrViewer {
 public:
  // Opens the avatar, the window and the headset. Throws Error when one of them cannot be had.
  explicit VrViewer(const VrOptions& options);

  // A frame of the headset's, or a while of waiting for it. False when it is over.
  bool Frame();
  // Ends as soon as the runtime agrees, or after a while.
  void Quit();

  ViewState& state() { return state_; }
  VrSession::Phase phase() const { return session_ ? session_->phase() : VrSession::Phase::kLost; }
  const VrFace& face() const { return face_; }
  const Pacing& pacing() const { return pacing_; }
  const RigidTransform& local_from_world() const { return local_from_world_; }  // mm

 private:
  using Clock = std::chrono::steady_clock;

  void Listen(const WindowInput& input);
  void Connect();
  void Disconnect(const std::string& why);
  void RunSession();
  void PassTime(const VrFrame& frame);
  bool DrawEyes(const VrFrame& frame, Clock::time_point began);
  void DrawMirror();

  const VrOptions options_;
  Window window_;
  GlFunctions gl_;
  ViewState state_;
  VrFace face_;
  VrHandMenu menu_;
  std::array<std::optional<GlCanvas>, 2> canvases_;  // the eyes, with smooth edges

  std::optional<VrRuntime> runtime_;
  std::optional<VrSession> session_;  // after the runtime: it goes first
  std::string status_;                // for the mirror
  Clock::time_point next_try_, give_up_ = Clock::time_point::max();
  bool over_ = false;

  RigidTransform local_from_world_;  // where the avatar stands
  bool bring_here_ = true;           // with the next frame that knows where the viewer is
  XrTime last_display_ = 0;          // 0: none that counts
  Pacing pacing_;
};

// Until the user closes the window, leaves by the headset's own menu, or interrupts the program. Then says how frames
// kept pace.
void RunVr(const VrOptions& options);

}  // namespace likeness
