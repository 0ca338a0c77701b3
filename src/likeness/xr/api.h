// OpenXR with what it says of OpenGL, its errors and its handles in the house's manner. Include this in place of
// openxr.h.

#pragma once

#define XR_USE_GRAPHICS_API_OPENGL
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace likeness {

// One of OpenXR's structures, which all begin with their type; the rest is zero.
template <typename Structure>
Structure Typed(XrStructureType type) {
  Structure structure = {};
  structure.type = type;
  return structure;
}

// The headset or its runtime has gone away: all that was made of it is to be made again. Thrown by CheckXr alone, and
// caught where that is done.
class HeadsetLost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// As OpenXR spells it: "XR_ERROR_FORM_FACTOR_UNAVAILABLE".
std::string XrResultName(XrResult result);

// Throws HeadsetLost or Error when a call has failed; `what` was being done: "beginning a frame".
void CheckXr(XrResult result, const char* what);

// Owns what OpenXR made; it is given back with the variable.
template <typename Handle, XrResult(XRAPI_PTR* Destroy)(Handle)>
class XrOwned {
 public:
  XrOwned() = default;
  explicit XrOwned(Handle handle) : handle_(handle) {}
  XrOwned(XrOwned&& other) noexcept : handle_(std::exchange(other.handle_, XR_NULL_HANDLE)) {}
  XrOwned& operator=(XrOwned&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~XrOwned() {
    if (handle_ != XR_NULL_HANDLE) Destroy(handle_);
  }

  Handle get() const { return handle_; }

 private:
  Handle handle_ = XR_NULL_HANDLE;
};

using OwnedInstance = XrOwned<XrInstance, xrDestroyInstance>;
using OwnedSession = XrOwned<XrSession, xrDestroySession>;
using OwnedSpace = XrOwned<XrSpace, xrDestroySpace>;
using OwnedSwapchain = XrOwned<XrSwapchain, xrDestroySwapchain>;
using OwnedActionSet = XrOwned<XrActionSet, xrDestroyActionSet>;

}  // namespace likeness
