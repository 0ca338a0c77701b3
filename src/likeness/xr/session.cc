#include "likeness/xr/session.h"

#include <algorithm>

#include "likeness/base/error.h"
#include "likeness/xr/eyes.h"
#include "likeness/xr/graphics_binding.h"

namespace likeness {
namespace {

constexpr XrViewConfigurationType kStereo = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;

// The runtime wants to be asked before a session is made, even by those who do not care.
void CheckOpenGl(const VrRuntime& runtime, const GlFunctions& gl) {
  PFN_xrVoidFunction function = nullptr;
  CheckXr(xrGetInstanceProcAddr(runtime.instance(), "xrGetOpenGLGraphicsRequirementsKHR", &function),
          "looking for OpenGL");
  auto needs = Typed<XrGraphicsRequirementsOpenGLKHR>(XR_TYPE_GRAPHICS_REQUIREMENTS_OPENGL_KHR);
  CheckXr(
      reinterpret_cast<PFN_xrGetOpenGLGraphicsRequirementsKHR>(function)(runtime.instance(), runtime.system(), &needs),
      "asking which OpenGL is needed");
  const XrVersion least = needs.minApiVersionSupported;
  if (!gl.AtLeast(XR_VERSION_MAJOR(least), XR_VERSION_MINOR(least))) {
    throw Error("the OpenXR runtime {} needs OpenGL {}.{}; this driver ({}) gives {}.{}: update it", runtime.name(),
                XR_VERSION_MAJOR(least), XR_VERSION_MINOR(least), gl.renderer, gl.major_version, gl.minor_version);
  }
}

std::vector<XrViewConfigurationView> EyesOf(const VrRuntime& runtime) {
  uint32_t count = 0;
  const auto ask = [&](uint32_t room, XrViewConfigurationView* views) {
    CheckXr(xrEnumerateViewConfigurationViews(runtime.instance(), runtime.system(), kStereo, room, &count, views),
            "asking for the headset's eyes");
  };
  ask(0, nullptr);
  std::vector<XrViewConfigurationView> views(count, Typed<XrViewConfigurationView>(XR_TYPE_VIEW_CONFIGURATION_VIEW));
  ask(count, views.data());
  if (count != 2) throw Error("the headset of {} has {} eyes; expected two", runtime.name(), count);
  return views;
}

// Opaque where the headset can; else what it likes best, such as light added to the room's.
XrEnvironmentBlendMode BlendModeOf(const VrRuntime& runtime) {
  uint32_t count = 0;
  const auto ask = [&](uint32_t room, XrEnvironmentBlendMode* modes) {
    CheckXr(xrEnumerateEnvironmentBlendModes(runtime.instance(), runtime.system(), kStereo, room, &count, modes),
            "asking how pictures meet the room");
  };
  ask(0, nullptr);
  std::vector<XrEnvironmentBlendMode> modes(count);
  ask(count, modes.data());
  const bool opaque = std::find(modes.begin(), modes.end(), XR_ENVIRONMENT_BLEND_MODE_OPAQUE) != modes.end();
  return opaque || modes.empty() ? XR_ENVIRONMENT_BLEND_MODE_OPAQUE : modes.front();
}

}  // namespace

VrSession::VrSession(const VrRuntime& runtime, const GlFunctions& gl, const GlLoader& loader) : runtime_(&runtime) {
  CheckOpenGl(runtime, gl);
  Connect(gl, loader);
}

void VrSession::Connect(const GlFunctions& gl, const GlLoader& loader) {
  const std::shared_ptr<const void> binding = CurrentGraphicsBinding(loader);
  auto info = Typed<XrSessionCreateInfo>(XR_TYPE_SESSION_CREATE_INFO);
  info.next = binding.get();
  info.systemId = runtime_->system();
  XrSession made = XR_NULL_HANDLE;
  CheckXr(xrCreateSession(runtime_->instance(), &info, &made), "opening a session with the headset");
  session_ = OwnedSession(made);
  const std::vector<XrViewConfigurationView> eyes = EyesOf(*runtime_);
  blend_ = BlendModeOf(*runtime_);
  local_ = ReferenceSpace(XR_REFERENCE_SPACE_TYPE_LOCAL);
  viewer_ = ReferenceSpace(XR_REFERENCE_SPACE_TYPE_VIEW);
  for (const XrViewConfigurationView& eye : eyes) swapchains_.emplace_back(made, gl, eye);
  hands_.emplace(runtime_->instance(), made);
}

OwnedSpace VrSession::ReferenceSpace(XrReferenceSpaceType type) const {
  auto info = Typed<XrReferenceSpaceCreateInfo>(XR_TYPE_REFERENCE_SPACE_CREATE_INFO);
  info.referenceSpaceType = type;
  info.poseInReferenceSpace.orientation.w = 1;
  XrSpace space = XR_NULL_HANDLE;
  CheckXr(xrCreateReferenceSpace(session_.get(), &info, &space), "making a space");
  return OwnedSpace(space);
}

VrSession::Phase VrSession::TakeEvents() {
  while (phase_ == Phase::kIdle || phase_ == Phase::kRunning) {
    auto event = Typed<XrEventDataBuffer>(XR_TYPE_EVENT_DATA_BUFFER);
    const XrResult result = xrPollEvent(runtime_->instance(), &event);
    CheckXr(result, "taking events");
    if (result == XR_EVENT_UNAVAILABLE) break;
    const auto* const base = reinterpret_cast<const XrEventDataBaseHeader*>(&event);
    if (base->type == XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED) {
      Enter(reinterpret_cast<const XrEventDataSessionStateChanged*>(base)->state);
    } else if (base->type == XR_TYPE_EVENT_DATA_REFERENCE_SPACE_CHANGE_PENDING) {
      const auto& change = *reinterpret_cast<const XrEventDataReferenceSpaceChangePending*>(base);
      if (change.referenceSpaceType == XR_REFERENCE_SPACE_TYPE_LOCAL) recentring_ = change.changeTime;
    } else if (base->type == XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING) {
      phase_ = Phase::kLost;
    }
  }
  return phase_;
}

// The others (synchronized, visible, focused) say what a frame says as well: whether it is seen, what is pressed.
void VrSession::Enter(XrSessionState state) {
  if (state == XR_SESSION_STATE_READY) {
    auto info = Typed<XrSessionBeginInfo>(XR_TYPE_SESSION_BEGIN_INFO);
    info.primaryViewConfigurationType = kStereo;
    CheckXr(xrBeginSession(session_.get(), &info), "beginning the session");
    phase_ = Phase::kRunning;
  } else if (state == XR_SESSION_STATE_STOPPING) {
    CheckXr(xrEndSession(session_.get()), "ending the session");
    phase_ = Phase::kIdle;
  } else if (state == XR_SESSION_STATE_LOSS_PENDING) {
    phase_ = Phase::kLost;
  } else if (state == XR_SESSION_STATE_EXITING) {
    phase_ = Phase::kOver;
  }
}

void VrSession::AskToEnd() {
  if (phase_ == Phase::kRunning) CheckXr(xrRequestExitSession(session_.get()), "asking to end the session");
}

bool VrSession::TakeRecentring(XrTime display_time) {
  if (!recentring_ || display_time < *recentring_) return false;
  recentring_.reset();
  return true;
}

VrFrame VrSession::BeginFrame() {
  VrFrame frame;
  auto state = Typed<XrFrameState>(XR_TYPE_FRAME_STATE);
  CheckXr(xrWaitFrame(session_.get(), nullptr, &state), "waiting for a frame");
  CheckXr(xrBeginFrame(session_.get(), nullptr), "beginning a frame");
  frame.display_time = state.predictedDisplayTime;
  frame.period = state.predictedDisplayPeriod;
  frame.visible = state.shouldRender == XR_TRUE;
  frame.hands = hands_->Read(session_.get(), local_.get(), frame.display_time);
  frame.recentred = TakeRecentring(frame.display_time);

  auto info = Typed<XrViewLocateInfo>(XR_TYPE_VIEW_LOCATE_INFO);
  info.viewConfigurationType = kStereo;
  info.displayTime = frame.display_time;
  info.space = local_.get();
  auto found = Typed<XrViewState>(XR_TYPE_VIEW_STATE);
  uint32_t count = 0;
  CheckXr(
      xrLocateViews(session_.get(), &info, &found, static_cast<uint32_t>(frame.eyes.size()), &count, frame.eyes.data()),
      "locating the eyes");
  constexpr XrViewStateFlags kBoth = XR_VIEW_STATE_ORIENTATION_VALID_BIT | XR_VIEW_STATE_POSITION_VALID_BIT;
  frame.located = (found.viewStateFlags & kBoth) == kBoth &&
                  Locate(viewer_.get(), local_.get(), frame.display_time, &frame.local_from_viewer);
  return frame;
}

void VrSession::DrawEye(size_t eye, const std::function<void(GLuint framebuffer)>& draw) {
  VrSwapchain& swapchain = swapchains_[eye];
  draw(swapchain.Acquire());
  swapchain.Release();
}

void VrSession::EndFrame(const VrFrame& frame, bool drawn) {
  std::array<XrCompositionLayerProjectionView, 2> views;
  for (size_t eye = 0; eye < views.size(); ++eye) {
    views[eye] = Typed<XrCompositionLayerProjectionView>(XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW);
    views[eye].pose = frame.eyes[eye].pose;
    views[eye].fov = frame.eyes[eye].fov;
    views[eye].subImage.swapchain = swapchains_[eye].get();
    views[eye].subImage.imageRect.extent = {width(eye), height(eye)};
  }
  auto layer = Typed<XrCompositionLayerProjection>(XR_TYPE_COMPOSITION_LAYER_PROJECTION);
  layer.space = local_.get();
  layer.viewCount = static_cast<uint32_t>(views.size());
  layer.views = views.data();
  const auto* const layers = reinterpret_cast<const XrCompositionLayerBaseHeader*>(&layer);
  auto info = Typed<XrFrameEndInfo>(XR_TYPE_FRAME_END_INFO);
  info.displayTime = frame.display_time;
  info.environmentBlendMode = blend_;
  info.layerCount = drawn ? 1 : 0;
  info.layers = drawn ? &layers : nullptr;
  CheckXr(xrEndFrame(session_.get(), &info), "handing over a frame");
}

}  // namespace likeness
