// The session's states and frames. Strict: what comes in the wrong order fails.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "likeness/xr/mock/mock_calls.h"

namespace likeness::mock {
namespace {

XrTime Now() { return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1); }

enum class Step { kNone, kWaited, kBegun };
Step step = Step::kNone;
XrTime last_display = 0;

XrResult CreateSession(XrInstance, const XrSessionCreateInfo* info, XrSession* session) {
  Note("xrCreateSession");
  MockHeadset& mock = Mock();
  const auto* const binding = static_cast<const XrBaseInStructure*>(info->next);
  if (binding == nullptr || binding->type != XR_TYPE_GRAPHICS_BINDING_OPENGL_XLIB_KHR) {
    return XR_ERROR_GRAPHICS_DEVICE_INVALID;
  }
  if (std::find(mock.calls.begin(), mock.calls.end(), "xrGetOpenGLGraphicsRequirementsKHR") == mock.calls.end()) {
    return XR_ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING;
  }
  *session = mock.session = NextHandle<XrSession>();
  ++mock.sessions;
  mock.lost = mock.running = mock.exiting = false;
  step = Step::kNone;
  mock.Go(XR_SESSION_STATE_IDLE);
  mock.PutOn();
  return XR_SUCCESS;
}

XrResult DestroySession(XrSession) {
  Note("xrDestroySession");
  Mock().session = XR_NULL_HANDLE;
  Mock().running = false;
  return XR_SUCCESS;
}

XrResult BeginSession(XrSession, const XrSessionBeginInfo*) {
  LIKENESS_MOCK_SESSION_CALL("xrBeginSession");
  if (Mock().running) return XR_ERROR_SESSION_RUNNING;
  if (Mock().state != XR_SESSION_STATE_READY) return XR_ERROR_SESSION_NOT_READY;
  Mock().running = true;
  return XR_SUCCESS;
}

XrResult EndSession(XrSession) {
  LIKENESS_MOCK_SESSION_CALL("xrEndSession");
  MockHeadset& mock = Mock();
  if (!mock.running) return XR_ERROR_SESSION_NOT_RUNNING;
  if (mock.state != XR_SESSION_STATE_STOPPING) return XR_ERROR_SESSION_NOT_STOPPING;
  mock.running = false;
  mock.Go(XR_SESSION_STATE_IDLE);
  if (mock.exiting) mock.Go(XR_SESSION_STATE_EXITING);
  return XR_SUCCESS;
}

XrResult RequestExitSession(XrSession) {
  LIKENESS_MOCK_SESSION_CALL("xrRequestExitSession");
  if (!Mock().running) return XR_ERROR_SESSION_NOT_RUNNING;
  Mock().exiting = true;
  Mock().TakeOff();
  return XR_SUCCESS;
}

// Displays are at multiples of the period; a frame has the period before its own to be drawn in.
XrResult WaitFrame(XrSession, const XrFrameWaitInfo*, XrFrameState* state) {
  LIKENESS_MOCK_SESSION_CALL("xrWaitFrame");
  MockHeadset& mock = Mock();
  if (!mock.running) return XR_ERROR_SESSION_NOT_RUNNING;
  if (step != Step::kNone) return XR_ERROR_CALL_ORDER_INVALID;
  step = Step::kWaited;
  const auto period = static_cast<XrDuration>(1e9 / mock.rate_hz);
  const XrTime next = (Now() / period + 2) * period;
  last_display = std::max(next, last_display + period);
  std::this_thread::sleep_until(std::chrono::steady_clock::time_point(std::chrono::nanoseconds(last_display - period)));
  state->predictedDisplayTime = last_display;
  state->predictedDisplayPeriod = period;
  const bool seen = mock.state == XR_SESSION_STATE_VISIBLE || mock.state == XR_SESSION_STATE_FOCUSED;
  state->shouldRender = seen ? XR_TRUE : XR_FALSE;
  return XR_SUCCESS;
}

XrResult BeginFrame(XrSession, const XrFrameBeginInfo*) {
  LIKENESS_MOCK_SESSION_CALL("xrBeginFrame");
  if (step != Step::kWaited) return XR_ERROR_CALL_ORDER_INVALID;
  step = Step::kBegun;
  return XR_SUCCESS;
}

XrResult EndFrame(XrSession, const XrFrameEndInfo* info) {
  LIKENESS_MOCK_SESSION_CALL("xrEndFrame");
  MockHeadset& mock = Mock();
  if (step != Step::kBegun) return XR_ERROR_CALL_ORDER_INVALID;
  step = Step::kNone;
  MockFrame frame;
  frame.display_time = info->displayTime;
  frame.shown = info->layerCount > 0;
  if (frame.shown) {
    const auto& layer = *reinterpret_cast<const XrCompositionLayerProjection*>(info->layers[0]);
    if (layer.type != XR_TYPE_COMPOSITION_LAYER_PROJECTION || layer.viewCount != 2) return XR_ERROR_LAYER_INVALID;
    for (size_t eye = 0; eye < 2; ++eye) {
      frame.local_from_eye[eye] = layer.views[eye].pose;
      frame.fields[eye] = layer.views[eye].fov;
      if (mock.keep_pictures) frame.pictures[eye] = LastPicture(layer.views[eye].subImage.swapchain);
    }
  }
  mock.frames.push_back(std::move(frame));
  if (mock.state == XR_SESSION_STATE_READY) {
    for (const XrSessionState next :
         {XR_SESSION_STATE_SYNCHRONIZED, XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_FOCUSED}) {
      mock.Go(next);
    }
  }
  return XR_SUCCESS;
}

}  // namespace

std::span<const Function> SessionFunctions() {
  static const Function functions[] = {LIKENESS_MOCK(CreateSession),      LIKENESS_MOCK(DestroySession),
                                       LIKENESS_MOCK(BeginSession),       LIKENESS_MOCK(EndSession),
                                       LIKENESS_MOCK(RequestExitSession), LIKENESS_MOCK(WaitFrame),
                                       LIKENESS_MOCK(BeginFrame),         LIKENESS_MOCK(EndFrame)};
  return functions;
}

}  // namespace likeness::mock
