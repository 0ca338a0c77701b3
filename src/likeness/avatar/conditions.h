// What an avatar is told besides code and view: whose face it shows, and the named conditions of the frame.

#pragma once

#include <string>
#include <vector>

#include "likeness/avatar/avatar.h"

namespace likeness {

struct FrameConditions {
  int identity = 0;  // index into the avatar's identities
  // Of the named conditions, one after another, as captured: [NamedChannels]. Empty: the means over training.
  std::vector<float> values;
};

// The conditions of a frame that the avatar has the code of.
FrameConditions ConditionsOf(const FrameCode& code);

// The condition vector c [ConditionChannels] that stands beside the code: the identity's part, then the standardised
// named conditions. Throws Error where the values are not as many as the avatar's, or the person is none of its.
std::vector<float> ConditionVector(const Avatar& avatar, const FrameConditions& conditions);

// Index of the person of this name. Throws Error naming the nearest one.
int FindIdentity(const Avatar& avatar, const std::string& name);

// Sets one named condition from "NAME=VALUE,VALUE,...", the others to their means if they have no values yet. Throws
// Error for a name that the avatar does not know, a wrong count, and what is no number.
void SetCondition(const Avatar& avatar, const std::string& assignment, FrameConditions* conditions);

}  // namespace likeness
