// A headset that is not there: an OpenXR runtime for tests, which OpenXR's own loader loads (XR_RUNTIME_JSON) and its
// validation layer watches. The test loads the same library, says by this structure what the headset does, and reads
// what it was told. For one thread, one session at a time.

#pragma once

#include <array>
#include <deque>
#include <string>
#include <vector>

#include "likeness/image/image.h"
#include "likeness/xr/api.h"

namespace likeness {

struct MockHand {
  bool tracked = false;
  XrPosef local_from_grip = {{0, 0, 0, 1}, {0, 0, 0}};
  XrPosef local_from_aim = {{0, 0, 0, 1}, {0, 0, 0}};
  bool select = false, menu = false, recentre = false;
};

// A frame as it was handed over.
struct MockFrame {
  XrTime display_time = 0;
  bool shown = false;  // with both eyes
  std::array<XrPosef, 2> local_from_eye = {};
  std::array<XrFovf, 2> fields = {};
  std::array<ImageU8, 2> pictures;  // RGB as stored, sRGB-encoded; empty unless they are kept
};

struct MockHeadset {
  // What the test sets, at any time.
  bool has_opengl = true, connected = true, tracked = true;
  bool lost = false;  // from now on calls of this session fail
  std::vector<int64_t> formats;
  int width = 180, height = 200;  // px, of an eye
  double rate_hz = 90;
  XrPosef local_from_head = {{0, 0, 0, 1}, {0, 0, 0}};  // at `moving_since`
  XrVector3f speed = {0, 0, 0};                         // of the head, m/s
  XrTime moving_since = 0;
  float eye_distance_m = 0.063f;
  std::array<XrFovf, 2> fields = {{{-0.85f, 0.7f, 0.75f, -0.8f}, {-0.7f, 0.85f, 0.75f, -0.8f}}};  // radians
  std::array<MockHand, 2> hands;
  bool keep_pictures = false;

  // What it was told.
  std::vector<std::string> calls;  // by name
  std::vector<MockFrame> frames;
  std::vector<XrTime> located;  // times for which the eyes were asked
  std::vector<std::string> bindings;
  int sessions = 0;  // that were opened

  // What it is at.
  XrSessionState state = XR_SESSION_STATE_UNKNOWN;
  bool running = false, exiting = false;
  std::deque<XrEventDataBuffer> events;

  // The session goes into a state, and the program is told.
  void Go(XrSessionState next) {
    state = next;
    auto event = Typed<XrEventDataSessionStateChanged>(XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED);
    event.session = session;
    event.state = next;
    Tell(event);
  }
  void PutOn() { Go(XR_SESSION_STATE_READY); }
  void TakeOff() {
    for (const XrSessionState next :
         {XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_SYNCHRONIZED, XR_SESSION_STATE_STOPPING}) {
      Go(next);
    }
  }
  // The user recentres by the headset's own menu: the local space moves at this time.
  void Recentre(XrTime when) {
    auto event = Typed<XrEventDataReferenceSpaceChangePending>(XR_TYPE_EVENT_DATA_REFERENCE_SPACE_CHANGE_PENDING);
    event.session = session;
    event.referenceSpaceType = XR_REFERENCE_SPACE_TYPE_LOCAL;
    event.changeTime = when;
    event.poseInPreviousSpace.orientation.w = 1;
    Tell(event);
  }
  template <typename Event>
  void Tell(const Event& event) {
    XrEventDataBuffer& buffer = events.emplace_back();
    *reinterpret_cast<Event*>(&buffer) = event;
  }

  XrInstance instance = XR_NULL_HANDLE;
  XrSession session = XR_NULL_HANDLE;
};

}  // namespace likeness

// The one headset of the library that it is in.
extern "C" likeness::MockHeadset* LikenessMockHeadset();
