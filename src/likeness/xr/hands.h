// The controllers: where they are and what is pressed.

#pragma once

#include <array>
#include <cstdint>

#include "likeness/geometry/rigid.h"
#include "likeness/xr/api.h"

namespace likeness {

enum VrSide : size_t { kLeft = 0, kRight = 1 };  // of eyes and hands, as OpenXR orders eyes

struct VrHand {
  bool held = false;  // its poses are known
  RigidTransform local_from_grip, local_from_aim;
  bool select = false;            // the trigger is held
  bool menu_pressed = false;      // since the last frame
  bool recentre_pressed = false;  // since the last frame
};

class VrHands {
 public:
  // Before the session's first frame; once a session.
  VrHands(XrInstance instance, XrSession session);

  // As they will be at the time of display. Nothing is held or pressed while the headset's own menus have the input.
  std::array<VrHand, 2> Read(XrSession session, XrSpace local, XrTime display_time) const;

 private:
  XrAction MakeAction(const char* name, const char* shown, XrActionType type) const;
  void SuggestBindings(XrInstance instance) const;
  OwnedSpace SpaceOf(XrSession session, XrAction pose, size_t side) const;
  bool Pressed(XrSession session, XrAction action, size_t side, bool at_once) const;

  std::array<XrPath, 2> sides_ = {};
  OwnedActionSet set_;
  XrAction grip_ = XR_NULL_HANDLE, aim_ = XR_NULL_HANDLE;
  XrAction select_ = XR_NULL_HANDLE, menu_ = XR_NULL_HANDLE, recentre_ = XR_NULL_HANDLE;
  std::array<OwnedSpace, 2> grips_, aims_;
};

// The pose of a space in another one at a time; false when it is not known.
bool Locate(XrSpace space, XrSpace base, XrTime time, RigidTransform* base_from_space);

}  // namespace likeness
