#include "likeness/xr/api.h"

#include <openxr/openxr_reflection.h>

#include "likeness/base/error.h"

namespace likeness {

std::string XrResultName(XrResult result) {
  switch (result) {
#define LIKENESS_XR_NAME(name, value) \
  case name:                          \
    return #name;
    XR_LIST_ENUM_XrResult(LIKENESS_XR_NAME)
#undef LIKENESS_XR_NAME
  }
  return "an error that this program does not know";
}

void CheckXr(XrResult result, const char* what) {
  if (XR_SUCCEEDED(result)) return;
  const std::string text = fmt::format("OpenXR reports {} while {}", XrResultName(result), what);
  switch (result) {
    case XR_ERROR_SESSION_LOST:
    case XR_ERROR_INSTANCE_LOST:
    case XR_ERROR_RUNTIME_UNAVAILABLE:
      throw HeadsetLost(text);
    default:
      throw Error("{}; its runtime may say more where it runs, or with XR_LOADER_DEBUG=all", text);
  }
}

}  // namespace likeness
