// The runtime's functions, by the file that has them, and what the files share.

#pragma once

#include <cstdint>
#include <span>

#include "likeness/xr/mock/mock_headset.h"

namespace likeness::mock {

struct Function {
  const char* name;
  PFN_xrVoidFunction function;
};
#define LIKENESS_MOCK(name) \
  { "xr" #name, reinterpret_cast<PFN_xrVoidFunction>(name) }

std::span<const Function> SessionFunctions();
std::span<const Function> SpaceFunctions();
std::span<const Function> PictureFunctions();
std::span<const Function> InputFunctions();

inline MockHeadset& Mock() { return *LikenessMockHeadset(); }

inline void Note(const char* call) { Mock().calls.emplace_back(call); }
// The same for calls that fail when the session is lost.
#define LIKENESS_MOCK_SESSION_CALL(name) \
  Note(name);                            \
  if (Mock().lost) return XR_ERROR_SESSION_LOST

// A handle that no other has.
uint64_t NextId();
template <typename Handle>
Handle NextHandle() {
  return reinterpret_cast<Handle>(NextId());  // NOLINT(performance-no-int-to-ptr): handles are opaque pointers
}

// OpenXR's way to return lists: the count alone, or as many as there is room for.
template <typename Value>
XrResult ReturnList(std::span<const Value> values, uint32_t room, uint32_t* count, Value* out) {
  *count = static_cast<uint32_t>(values.size());
  if (room == 0) return XR_SUCCESS;
  if (room < values.size()) return XR_ERROR_SIZE_INSUFFICIENT;
  for (size_t i = 0; i < values.size(); ++i) out[i] = values[i];
  return XR_SUCCESS;
}

// Of pictures: what was handed over last by a swapchain, and nothing left behind by a session that ends.
ImageU8 LastPicture(XrSwapchain swapchain);
// Of input: a controller's pose by the space that was made for it; null for the spaces of others.
const XrPosef* HandPose(XrSpace space, bool* tracked);

XrPosef HeadAt(XrTime time);
XrPosef EyeAt(size_t eye, XrTime time);

}  // namespace likeness::mock
