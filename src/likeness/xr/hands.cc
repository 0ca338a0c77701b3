#include "likeness/xr/hands.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/xr/eyes.h"

namespace likeness {
namespace {

constexpr const char* kHands[] = {"/user/hand/left", "/user/hand/right"};

// What does what, controller by controller; runtimes map others to these. Touch has other buttons on each side.
struct Bindings {
  const char* profile;
  const char* select;
  const char* menu[2];      // left, right
  const char* recentre[2];  // null: in the menu alone
};
constexpr Bindings kBindings[] = {
    {"/interaction_profiles/khr/simple_controller",
     "/input/select/click",
     {"/input/menu/click", "/input/menu/click"},
     {nullptr, nullptr}},
    {"/interaction_profiles/oculus/touch_controller",
     "/input/trigger/value",
     {"/input/x/click", "/input/a/click"},
     {"/input/y/click", "/input/b/click"}},
    {"/interaction_profiles/valve/index_controller",
     "/input/trigger/click",
     {"/input/a/click", "/input/a/click"},
     {"/input/b/click", "/input/b/click"}},
};

XrPath PathOf(XrInstance instance, const std::string& text) {
  XrPath path = XR_NULL_PATH;
  CheckXr(xrStringToPath(instance, text.c_str(), &path), "naming a part of a controller");
  return path;
}

template <size_t kSize>
void CopyName(std::string_view name, char (&field)[kSize]) {
  std::copy_n(name.begin(), std::min(name.size(), kSize - 1), field);
}

}  // namespace

VrHands::VrHands(XrInstance instance, XrSession session) {
  for (const size_t side : {kLeft, kRight}) sides_[side] = PathOf(instance, kHands[side]);
  auto info = Typed<XrActionSetCreateInfo>(XR_TYPE_ACTION_SET_CREATE_INFO);
  CopyName("avatar", info.actionSetName);
  CopyName("Avatar", info.localizedActionSetName);
  XrActionSet made = XR_NULL_HANDLE;
  CheckXr(xrCreateActionSet(instance, &info, &made), "making the actions");
  set_ = OwnedActionSet(made);
  grip_ = MakeAction("hand", "Hand", XR_ACTION_TYPE_POSE_INPUT);
  aim_ = MakeAction("pointer", "Pointer", XR_ACTION_TYPE_POSE_INPUT);
  select_ = MakeAction("select", "Press what is pointed at", XR_ACTION_TYPE_BOOLEAN_INPUT);
  menu_ = MakeAction("menu", "Show or hide the menu", XR_ACTION_TYPE_BOOLEAN_INPUT);
  recentre_ = MakeAction("recentre", "Bring the avatar here", XR_ACTION_TYPE_BOOLEAN_INPUT);
  SuggestBindings(instance);
  auto attach = Typed<XrSessionActionSetsAttachInfo>(XR_TYPE_SESSION_ACTION_SETS_ATTACH_INFO);
  attach.countActionSets = 1;
  attach.actionSets = &made;
  CheckXr(xrAttachSessionActionSets(session, &attach), "attaching the actions");
  for (const size_t side : {kLeft, kRight}) {
    grips_[side] = SpaceOf(session, grip_, side);
    aims_[side] = SpaceOf(session, aim_, side);
  }
}

XrAction VrHands::MakeAction(const char* name, const char* shown, XrActionType type) const {
  auto info = Typed<XrActionCreateInfo>(XR_TYPE_ACTION_CREATE_INFO);
  CopyName(name, info.actionName);
  CopyName(shown, info.localizedActionName);
  info.actionType = type;
  info.countSubactionPaths = static_cast<uint32_t>(sides_.size());
  info.subactionPaths = sides_.data();
  XrAction action = XR_NULL_HANDLE;
  CheckXr(xrCreateAction(set_.get(), &info, &action), "making an action");
  return action;  // goes with its set
}

void VrHands::SuggestBindings(XrInstance instance) const {
  for (const Bindings& bindings : kBindings) {
    std::vector<XrActionSuggestedBinding> list;
    for (const size_t side : {kLeft, kRight}) {
      const auto add = [&](XrAction action, const char* part) {
        if (part != nullptr) list.push_back({action, PathOf(instance, std::string(kHands[side]) + part)});
      };
      add(grip_, "/input/grip/pose");
      add(aim_, "/input/aim/pose");
      add(select_, bindings.select);
      add(menu_, bindings.menu[side]);
      add(recentre_, bindings.recentre[side]);
    }
    auto suggested = Typed<XrInteractionProfileSuggestedBinding>(XR_TYPE_INTERACTION_PROFILE_SUGGESTED_BINDING);
    suggested.interactionProfile = PathOf(instance, bindings.profile);
    suggested.countSuggestedBindings = static_cast<uint32_t>(list.size());
    suggested.suggestedBindings = list.data();
    CheckXr(xrSuggestInteractionProfileBindings(instance, &suggested), "suggesting what the buttons do");
  }
}

OwnedSpace VrHands::SpaceOf(XrSession session, XrAction pose, size_t side) const {
  auto info = Typed<XrActionSpaceCreateInfo>(XR_TYPE_ACTION_SPACE_CREATE_INFO);
  info.action = pose;
  info.subactionPath = sides_[side];
  info.poseInActionSpace.orientation.w = 1;
  XrSpace space = XR_NULL_HANDLE;
  CheckXr(xrCreateActionSpace(session, &info, &space), "making a hand's space");
  return OwnedSpace(space);
}

bool VrHands::Pressed(XrSession session, XrAction action, size_t side, bool at_once) const {
  auto info = Typed<XrActionStateGetInfo>(XR_TYPE_ACTION_STATE_GET_INFO);
  info.action = action;
  info.subactionPath = sides_[side];
  auto state = Typed<XrActionStateBoolean>(XR_TYPE_ACTION_STATE_BOOLEAN);
  CheckXr(xrGetActionStateBoolean(session, &info, &state), "reading a button");
  const bool pressed = state.isActive == XR_TRUE && state.currentState == XR_TRUE;
  return pressed && (!at_once || state.changedSinceLastSync == XR_TRUE);
}

std::array<VrHand, 2> VrHands::Read(XrSession session, XrSpace local, XrTime display_time) const {
  std::array<VrHand, 2> hands;
  const XrActiveActionSet active = {set_.get(), XR_NULL_PATH};
  auto sync = Typed<XrActionsSyncInfo>(XR_TYPE_ACTIONS_SYNC_INFO);
  sync.countActiveActionSets = 1;
  sync.activeActionSets = &active;
  const XrResult result = xrSyncActions(session, &sync);
  CheckXr(result, "reading the controllers");
  if (result == XR_SESSION_NOT_FOCUSED) return hands;
  for (const size_t side : {kLeft, kRight}) {
    VrHand& hand = hands[side];
    hand.held = Locate(grips_[side].get(), local, display_time, &hand.local_from_grip) &&
                Locate(aims_[side].get(), local, display_time, &hand.local_from_aim);
    hand.select = Pressed(session, select_, side, false);
    hand.menu_pressed = Pressed(session, menu_, side, true);
    hand.recentre_pressed = Pressed(session, recentre_, side, true);
  }
  return hands;
}

bool Locate(XrSpace space, XrSpace base, XrTime time, RigidTransform* base_from_space) {
  auto location = Typed<XrSpaceLocation>(XR_TYPE_SPACE_LOCATION);
  CheckXr(xrLocateSpace(space, base, time, &location), "locating a hand or the headset");
  constexpr XrSpaceLocationFlags kBoth = XR_SPACE_LOCATION_ORIENTATION_VALID_BIT | XR_SPACE_LOCATION_POSITION_VALID_BIT;
  if ((location.locationFlags & kBoth) != kBoth) return false;
  *base_from_space = FromXrPose(location.pose);
  return true;
}

}  // namespace likeness
