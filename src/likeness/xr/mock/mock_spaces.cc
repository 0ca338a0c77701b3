// Where the head, the eyes and the hands are. The local space stays where it is.

#include <Eigen/Geometry>
#include <set>

#include "likeness/xr/mock/mock_calls.h"

namespace likeness::mock {
namespace {

std::set<XrSpace> viewer_spaces;

XrResult CreateReferenceSpace(XrSession, const XrReferenceSpaceCreateInfo* info, XrSpace* space) {
  LIKENESS_MOCK_SESSION_CALL("xrCreateReferenceSpace");
  *space = NextHandle<XrSpace>();
  if (info->referenceSpaceType == XR_REFERENCE_SPACE_TYPE_VIEW) viewer_spaces.insert(*space);
  return XR_SUCCESS;
}

XrResult DestroySpace(XrSpace space) {
  viewer_spaces.erase(space);
  return XR_SUCCESS;
}

XrResult LocateSpace(XrSpace space, XrSpace, XrTime time, XrSpaceLocation* location) {
  LIKENESS_MOCK_SESSION_CALL("xrLocateSpace");
  bool tracked = Mock().tracked;
  const XrPosef* const hand = HandPose(space, &tracked);
  const bool viewer = viewer_spaces.contains(space);
  location->pose = hand != nullptr ? *hand : viewer ? HeadAt(time) : XrPosef{{0, 0, 0, 1}, {0, 0, 0}};
  location->locationFlags = tracked
                                ? XR_SPACE_LOCATION_ORIENTATION_VALID_BIT | XR_SPACE_LOCATION_POSITION_VALID_BIT |
                                      XR_SPACE_LOCATION_ORIENTATION_TRACKED_BIT | XR_SPACE_LOCATION_POSITION_TRACKED_BIT
                                : 0;
  return XR_SUCCESS;
}

XrResult LocateViews(XrSession, const XrViewLocateInfo* info, XrViewState* state, uint32_t room, uint32_t* count,
                     XrView* views) {
  LIKENESS_MOCK_SESSION_CALL("xrLocateViews");
  MockHeadset& mock = Mock();
  mock.located.push_back(info->displayTime);
  *count = 2;
  if (room == 0) return XR_SUCCESS;
  for (size_t eye = 0; eye < 2; ++eye) {
    views[eye].pose = EyeAt(eye, info->displayTime);
    views[eye].fov = mock.fields[eye];
  }
  state->viewStateFlags = mock.tracked ? XR_VIEW_STATE_ORIENTATION_VALID_BIT | XR_VIEW_STATE_POSITION_VALID_BIT |
                                             XR_VIEW_STATE_ORIENTATION_TRACKED_BIT | XR_VIEW_STATE_POSITION_TRACKED_BIT
                                       : 0;
  return XR_SUCCESS;
}

}  // namespace

XrPosef HeadAt(XrTime time) {
  const MockHeadset& mock = Mock();
  const auto seconds = static_cast<float>(static_cast<double>(time - mock.moving_since) * 1e-9);
  XrPosef pose = mock.local_from_head;
  pose.position.x += mock.speed.x * seconds;
  pose.position.y += mock.speed.y * seconds;
  pose.position.z += mock.speed.z * seconds;
  return pose;
}

XrPosef EyeAt(size_t eye, XrTime time) {
  XrPosef pose = HeadAt(time);
  const XrQuaternionf& q = pose.orientation;
  const float sideways = (eye == 0 ? -0.5f : 0.5f) * Mock().eye_distance_m;
  const Eigen::Vector3f moved = Eigen::Quaternionf(q.w, q.x, q.y, q.z) * Eigen::Vector3f(sideways, 0, 0);
  pose.position.x += moved.x();
  pose.position.y += moved.y();
  pose.position.z += moved.z();
  return pose;
}

std::span<const Function> SpaceFunctions() {
  static const Function functions[] = {LIKENESS_MOCK(CreateReferenceSpace), LIKENESS_MOCK(DestroySpace),
                                       LIKENESS_MOCK(LocateSpace), LIKENESS_MOCK(LocateViews)};
  return functions;
}

}  // namespace likeness::mock
