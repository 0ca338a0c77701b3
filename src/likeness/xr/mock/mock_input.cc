// Controllers. Bindings that the controllers do not have are refused, as real runtimes do.

#include <array>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/xr/mock/mock_calls.h"

namespace likeness::mock {
namespace {

constexpr std::array<std::string_view, 2> kHands = {"/user/hand/left", "/user/hand/right"};

// Inputs of the interaction profiles in OpenXR 1.0, without thumbsticks, touches and the like.
struct Profile {
  std::string_view name;
  std::vector<std::string_view> both, left, right;
};
const std::vector<Profile>& Profiles() {
  static const std::vector<Profile> profiles = {
      {"/interaction_profiles/khr/simple_controller", {"select/click", "menu/click", "grip/pose", "aim/pose"}, {}, {}},
      {"/interaction_profiles/oculus/touch_controller",
       {"squeeze/value", "trigger/value", "grip/pose", "aim/pose"},
       {"x/click", "y/click", "menu/click"},
       {"a/click", "b/click", "system/click"}},
      {"/interaction_profiles/valve/index_controller",
       {"system/click", "a/click", "b/click", "squeeze/value", "trigger/click", "trigger/value", "grip/pose",
        "aim/pose"},
       {},
       {}},
  };
  return profiles;
}

struct PoseSpace {
  std::string action;
  size_t side = 0;
};
struct Buttons {
  bool select = false, menu = false, recentre = false;

  bool ByAction(std::string_view action) const {
    return action == "select" ? select : action == "menu" ? menu : recentre;
  }
};

std::vector<std::string> paths = {""};  // by their ids
std::map<XrAction, std::string> actions;
std::map<XrSpace, PoseSpace> pose_spaces;
std::array<Buttons, 2> now, before;

size_t SideOf(XrPath path) { return paths.at(path) == kHands[1] ? 1 : 0; }

bool Has(const Profile& profile, const std::string& path) {
  const auto lists = [&](const std::vector<std::string_view>& inputs, std::string_view hand) {
    for (const std::string_view input : inputs) {
      if (path == std::string(hand) + "/input/" + std::string(input)) return true;
    }
    return false;
  };
  return lists(profile.both, kHands[0]) || lists(profile.both, kHands[1]) || lists(profile.left, kHands[0]) ||
         lists(profile.right, kHands[1]);
}

XrResult StringToPath(XrInstance, const char* text, XrPath* path) {
  for (*path = 1; *path < paths.size() && paths[*path] != text;) ++*path;
  if (*path == paths.size()) paths.emplace_back(text);
  return XR_SUCCESS;
}

XrResult CreateActionSet(XrInstance, const XrActionSetCreateInfo*, XrActionSet* set) {
  *set = NextHandle<XrActionSet>();
  return XR_SUCCESS;
}

XrResult DestroyActionSet(XrActionSet) { return XR_SUCCESS; }

XrResult CreateAction(XrActionSet, const XrActionCreateInfo* info, XrAction* action) {
  *action = NextHandle<XrAction>();
  actions[*action] = info->actionName;
  return XR_SUCCESS;
}

XrResult DestroyAction(XrAction) { return XR_SUCCESS; }

XrResult SuggestInteractionProfileBindings(XrInstance, const XrInteractionProfileSuggestedBinding* suggested) {
  Note("xrSuggestInteractionProfileBindings");
  for (const Profile& profile : Profiles()) {
    if (paths.at(suggested->interactionProfile) != profile.name) continue;
    for (uint32_t i = 0; i < suggested->countSuggestedBindings; ++i) {
      const XrActionSuggestedBinding& binding = suggested->suggestedBindings[i];
      if (!Has(profile, paths.at(binding.binding))) return XR_ERROR_PATH_UNSUPPORTED;
      Mock().bindings.push_back(actions.at(binding.action) + " " + paths.at(binding.binding));
    }
    return XR_SUCCESS;
  }
  return XR_ERROR_PATH_UNSUPPORTED;
}

XrResult AttachSessionActionSets(XrSession, const XrSessionActionSetsAttachInfo*) {
  LIKENESS_MOCK_SESSION_CALL("xrAttachSessionActionSets");
  return XR_SUCCESS;
}

XrResult CreateActionSpace(XrSession, const XrActionSpaceCreateInfo* info, XrSpace* space) {
  LIKENESS_MOCK_SESSION_CALL("xrCreateActionSpace");
  *space = NextHandle<XrSpace>();
  pose_spaces[*space] = {actions.at(info->action), SideOf(info->subactionPath)};
  return XR_SUCCESS;
}

XrResult SyncActions(XrSession, const XrActionsSyncInfo*) {
  LIKENESS_MOCK_SESSION_CALL("xrSyncActions");
  if (Mock().state != XR_SESSION_STATE_FOCUSED) return XR_SESSION_NOT_FOCUSED;
  before = now;
  for (size_t side = 0; side < 2; ++side) {
    const MockHand& hand = Mock().hands[side];
    now[side] = {hand.select, hand.menu, hand.recentre};
  }
  return XR_SUCCESS;
}

XrResult GetActionStateBoolean(XrSession, const XrActionStateGetInfo* info, XrActionStateBoolean* state) {
  LIKENESS_MOCK_SESSION_CALL("xrGetActionStateBoolean");
  const size_t side = SideOf(info->subactionPath);
  const std::string& action = actions.at(info->action);
  state->isActive = Mock().hands[side].tracked ? XR_TRUE : XR_FALSE;
  state->currentState = now[side].ByAction(action) ? XR_TRUE : XR_FALSE;
  state->changedSinceLastSync = now[side].ByAction(action) != before[side].ByAction(action) ? XR_TRUE : XR_FALSE;
  return XR_SUCCESS;
}

}  // namespace

const XrPosef* HandPose(XrSpace space, bool* tracked) {
  const auto found = pose_spaces.find(space);
  if (found == pose_spaces.end()) return nullptr;
  const MockHand& hand = Mock().hands[found->second.side];
  *tracked = hand.tracked;
  return found->second.action == "hand" ? &hand.local_from_grip : &hand.local_from_aim;
}

std::span<const Function> InputFunctions() {
  static const Function functions[] = {LIKENESS_MOCK(StringToPath),
                                       LIKENESS_MOCK(CreateActionSet),
                                       LIKENESS_MOCK(DestroyActionSet),
                                       LIKENESS_MOCK(CreateAction),
                                       LIKENESS_MOCK(DestroyAction),
                                       LIKENESS_MOCK(SuggestInteractionProfileBindings),
                                       LIKENESS_MOCK(AttachSessionActionSets),
                                       LIKENESS_MOCK(CreateActionSpace),
                                       LIKENESS_MOCK(SyncActions),
                                       LIKENESS_MOCK(GetActionStateBoolean)};
  return functions;
}

}  // namespace likeness::mock
