#include "likeness/xr/runtime.h"

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "likeness/base/error.h"

namespace likeness {
namespace {

constexpr char kSelect[] =
    "select one by XR_RUNTIME_JSON=FILE.json or ~/.config/openxr/1/active_runtime.json (docs/vr.md)";

Error NoRuntime(XrResult result) {
  const char* const chosen = std::getenv("XR_RUNTIME_JSON");
  if (chosen != nullptr) {
    return FileError(chosen, fmt::format("cannot be used as the OpenXR runtime ({}); expected a runtime's manifest; "
                                         "unset XR_RUNTIME_JSON, or {}",
                                         XrResultName(result), kSelect));
  }
  return Error("no OpenXR runtime can be used ({}); install one, such as Monado, SteamVR or WiVRn, and {}",
               XrResultName(result), kSelect);
}

bool HasOpenGl() {
  uint32_t count = 0;
  const XrResult result = xrEnumerateInstanceExtensionProperties(nullptr, 0, &count, nullptr);
  if (XR_FAILED(result)) throw NoRuntime(result);
  std::vector<XrExtensionProperties> extensions(count, Typed<XrExtensionProperties>(XR_TYPE_EXTENSION_PROPERTIES));
  CheckXr(xrEnumerateInstanceExtensionProperties(nullptr, count, &count, extensions.data()), "listing extensions");
  return std::any_of(extensions.begin(), extensions.end(), [](const XrExtensionProperties& extension) {
    return std::string_view(extension.extensionName) == XR_KHR_OPENGL_ENABLE_EXTENSION_NAME;
  });
}

XrInstance MakeInstance() {
  auto info = Typed<XrInstanceCreateInfo>(XR_TYPE_INSTANCE_CREATE_INFO);
  constexpr std::string_view kName = "likeness";
  std::copy(kName.begin(), kName.end(), info.applicationInfo.applicationName);
  // Not the header's version: older runtimes refuse one that is newer than theirs.
  info.applicationInfo.apiVersion = XR_MAKE_VERSION(1, 0, 0);
  const char* const extension = XR_KHR_OPENGL_ENABLE_EXTENSION_NAME;
  info.enabledExtensionCount = 1;
  info.enabledExtensionNames = &extension;
  XrInstance instance = XR_NULL_HANDLE;
  const XrResult result = xrCreateInstance(&info, &instance);
  if (XR_FAILED(result)) {
    throw Error(
        "the OpenXR runtime does not answer ({}); start its service (monado-service, SteamVR, wivrn-server), or {}",
        XrResultName(result), kSelect);
  }
  return instance;
}

}  // namespace

VrRuntime::VrRuntime() {
  // The loader's own lines would tell of the same mistakes once more, in its words.
  setenv("XR_LOADER_DEBUG", "none", 0);
  const bool has_opengl = HasOpenGl();
  if (!has_opengl)
    throw Error("the OpenXR runtime lacks OpenGL ({}); {}", XR_KHR_OPENGL_ENABLE_EXTENSION_NAME, kSelect);
  instance_ = OwnedInstance(MakeInstance());
  auto properties = Typed<XrInstanceProperties>(XR_TYPE_INSTANCE_PROPERTIES);
  CheckXr(xrGetInstanceProperties(instance(), &properties), "asking for the runtime's name");
  const XrVersion version = properties.runtimeVersion;
  name_ = fmt::format("{} {}.{}.{}", properties.runtimeName, XR_VERSION_MAJOR(version), XR_VERSION_MINOR(version),
                      XR_VERSION_PATCH(version));
  auto wanted = Typed<XrSystemGetInfo>(XR_TYPE_SYSTEM_GET_INFO);
  wanted.formFactor = XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY;
  const XrResult result = xrGetSystem(instance(), &wanted, &system_);
  if (result == XR_ERROR_FORM_FACTOR_UNAVAILABLE || result == XR_ERROR_FORM_FACTOR_UNSUPPORTED) {
    throw Error("no headset is connected, says the OpenXR runtime {} ({}); connect one and switch it on, or {}", name_,
                XrResultName(result), kSelect);
  }
  CheckXr(result, "looking for a headset");
}

}  // namespace likeness
