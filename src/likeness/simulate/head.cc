#include "likeness/simulate/head.h"

#include <algorithm>

#include "likeness/base/error.h"
#include "likeness/base/text.h"

namespace likeness {

const std::array<std::string, kExpressionCount>& ExpressionNames() {
  static const std::array<std::string, kExpressionCount> names = {"eyeBlinkLeft",
                                                                  "eyeLookDownLeft",
                                                                  "eyeLookInLeft",
                                                                  "eyeLookOutLeft",
                                                                  "eyeLookUpLeft",
                                                                  "eyeSquintLeft",
                                                                  "eyeWideLeft",
                                                                  "eyeBlinkRight",
                                                                  "eyeLookDownRight",
                                                                  "eyeLookInRight",
                                                                  "eyeLookOutRight",
                                                                  "eyeLookUpRight",
                                                                  "eyeSquintRight",
                                                                  "eyeWideRight",
                                                                  "jawForward",
                                                                  "jawRight",
                                                                  "jawLeft",
                                                                  "jawOpen",
                                                                  "mouthClose",
                                                                  "mouthFunnel",
                                                                  "mouthPucker",
                                                                  "mouthRight",
                                                                  "mouthLeft",
                                                                  "mouthSmileLeft",
                                                                  "mouthSmileRight",
                                                                  "mouthFrownLeft",
                                                                  "mouthFrownRight",
                                                                  "mouthDimpleLeft",
                                                                  "mouthDimpleRight",
                                                                  "mouthStretchLeft",
                                                                  "mouthStretchRight",
                                                                  "mouthRollLower",
                                                                  "mouthRollUpper",
                                                                  "mouthShrugLower",
                                                                  "mouthShrugUpper",
                                                                  "mouthPressLeft",
                                                                  "mouthPressRight",
                                                                  "mouthLowerDownLeft",
                                                                  "mouthLowerDownRight",
                                                                  "mouthUpperUpLeft",
                                                                  "mouthUpperUpRight",
                                                                  "browDownLeft",
                                                                  "browDownRight",
                                                                  "browInnerUp",
                                                                  "browOuterUpLeft",
                                                                  "browOuterUpRight",
                                                                  "cheekPuff",
                                                                  "cheekSquintLeft",
                                                                  "cheekSquintRight",
                                                                  "noseSneerLeft",
                                                                  "noseSneerRight",
                                                                  "tongueOut"};
  return names;
}

int ExpressionIndex(const std::string& name) {
  const auto& names = ExpressionNames();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<int>(found - names.begin());
  const std::string nearest = NearestWord(name, {names.begin(), names.end()});
  throw Error("'{}' is no expression{}", name, nearest.empty() ? "" : fmt::format("; the nearest is '{}'", nearest));
}

}  // namespace likeness
