// The OpenGL context that is current, as OpenXR wants to be told of it.

#pragma once

#include <memory>

#include "likeness/gl/functions.h"

namespace likeness {

// For XrSessionCreateInfo::next, as long as it lives. Of X11 (GLX): what SteamVR and Monado take. Throws Error when the
// context that is current in this thread is none of X11's.
//   loader  knows GLX's functions, too
std::shared_ptr<const void> CurrentGraphicsBinding(const GlLoader& loader);

}  // namespace likeness
