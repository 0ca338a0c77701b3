// What is asked of a decoder, checked before anything is written. All throw Error.

#pragma once

#include <span>

#include "likeness/avatar/architecture.h"
#include "likeness/decode/network.h"

namespace likeness {

inline constexpr int kMostViews = 2;

void CheckCode(std::span<const float> code, const Architecture& architecture);  // finite, as long as the avatar's are
void CheckViewCount(size_t views);
void CheckDirection(const float direction[3]);  // a unit vector
void CheckDisplay(const DisplayTransform& display);
void CheckConditions(std::span<const float> values);  // finite

}  // namespace likeness
