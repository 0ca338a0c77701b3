// A session with the headset: its states, its frames, its two eyes. It knows nothing of avatars.

#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>

#include "likeness/gl/functions.h"
#include "likeness/xr/api.h"
#include "likeness/xr/hands.h"
#include "likeness/xr/runtime.h"
#include "likeness/xr/swapchain.h"

namespace likeness {

// What the runtime says of a frame that is to be drawn.
struct VrFrame {
  XrTime display_time = 0;  // when it will be seen, ns; all poses are of this time
  XrDuration period = 0;    // from one display to the next, ns
  bool visible = false;     // false: nothing of it will be seen
  bool located = false;     // the poses of the eyes and the head are known
  std::array<XrView, 2> eyes = {Typed<XrView>(XR_TYPE_VIEW), Typed<XrView>(XR_TYPE_VIEW)};
  RigidTransform local_from_viewer;  // between the eyes
  std::array<VrHand, 2> hands;
  bool recentred = false;  // the runtime has moved the local space before this frame: what stood in it stands elsewhere
};

class VrSession {
 public:
  // With the OpenGL context that is current now and in every call. The runtime outlives it. Throws Error when the
  // runtime needs a newer OpenGL.
  VrSession(const VrRuntime& runtime, const GlFunctions& gl, const GlLoader& loader);

  enum class Phase {
    kIdle,     // the headset is not worn, or the runtime is not ready
    kRunning,  // frames are to be drawn, one after the other
    kLost,     // make a new runtime and a new session
    kOver,     // the user or the runtime has ended it
  };
  // Takes what the runtime has to say, and begins and ends as it asks.
  Phase TakeEvents();
  Phase phase() const { return phase_; }
  // Asks the runtime to end it: kOver follows. Nothing where it is not running.
  void AskToEnd();

  int width(size_t eye) const { return swapchains_[eye].width(); }
  int height(size_t eye) const { return swapchains_[eye].height(); }

  // Waits until it is time for the next frame. Then the eyes are drawn, or not, and EndFrame hands them over.
  VrFrame BeginFrame();
  //   draw  into this framebuffer, as large as the eye, with values that are sRGB-encoded
  void DrawEye(size_t eye, const std::function<void(GLuint framebuffer)>& draw);
  //   drawn  both eyes; otherwise nothing is shown
  void EndFrame(const VrFrame& frame, bool drawn);

 private:
  void Connect(const GlFunctions& gl, const GlLoader& loader);
  OwnedSpace ReferenceSpace(XrReferenceSpaceType type) const;
  void Enter(XrSessionState state);
  bool TakeRecentring(XrTime display_time);

  const VrRuntime* runtime_;
  OwnedSession session_;
  OwnedSpace local_, viewer_;
  std::vector<VrSwapchain> swapchains_;  // left, right
  std::optional<VrHands> hands_;
  XrEnvironmentBlendMode blend_ = XR_ENVIRONMENT_BLEND_MODE_OPAQUE;
  Phase phase_ = Phase::kIdle;
  std::optional<XrTime> recentring_;  // when the local space moves
};

}  // namespace likeness
