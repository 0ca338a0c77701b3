// The way in, and the instance.

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>
#include <unordered_map>

#include "likeness/xr/mock/mock_calls.h"

extern "C" __attribute__((visibility("default"))) likeness::MockHeadset* LikenessMockHeadset() {
  static likeness::MockHeadset headset;
  return &headset;
}

namespace likeness::mock {

uint64_t NextId() {
  static uint64_t last = 0x1000;
  return ++last;
}

namespace {

template <size_t kSize>
void CopyText(std::string_view text, char (&field)[kSize]) {
  std::fill_n(field, kSize, '\0');
  std::copy_n(text.begin(), std::min(text.size(), kSize - 1), field);
}

XrResult EnumerateInstanceExtensionProperties(const char*, uint32_t room, uint32_t* count, XrExtensionProperties* out) {
  std::vector<XrExtensionProperties> extensions;
  if (Mock().has_opengl) {
    auto& extension = extensions.emplace_back(Typed<XrExtensionProperties>(XR_TYPE_EXTENSION_PROPERTIES));
    CopyText(XR_KHR_OPENGL_ENABLE_EXTENSION_NAME, extension.extensionName);
    extension.extensionVersion = XR_KHR_opengl_enable_SPEC_VERSION;
  }
  return ReturnList<XrExtensionProperties>(extensions, room, count, out);
}

XrResult CreateInstance(const XrInstanceCreateInfo*, XrInstance* instance) {
  Note("xrCreateInstance");
  *instance = Mock().instance = NextHandle<XrInstance>();
  return XR_SUCCESS;
}

XrResult DestroyInstance(XrInstance) {
  Note("xrDestroyInstance");
  Mock().instance = XR_NULL_HANDLE;
  Mock().events.clear();
  return XR_SUCCESS;
}

XrResult GetInstanceProperties(XrInstance, XrInstanceProperties* properties) {
  properties->runtimeVersion = XR_MAKE_VERSION(1, 2, 3);
  CopyText("Mock headset", properties->runtimeName);
  return XR_SUCCESS;
}

XrResult GetSystem(XrInstance, const XrSystemGetInfo*, XrSystemId* system) {
  if (!Mock().connected) return XR_ERROR_FORM_FACTOR_UNAVAILABLE;
  *system = 1;
  return XR_SUCCESS;
}

XrResult EnumerateViewConfigurationViews(XrInstance, XrSystemId, XrViewConfigurationType, uint32_t room,
                                         uint32_t* count, XrViewConfigurationView* out) {
  auto view = Typed<XrViewConfigurationView>(XR_TYPE_VIEW_CONFIGURATION_VIEW);
  view.recommendedImageRectWidth = static_cast<uint32_t>(Mock().width);
  view.recommendedImageRectHeight = static_cast<uint32_t>(Mock().height);
  view.maxImageRectWidth = view.maxImageRectHeight = 4096;
  view.recommendedSwapchainSampleCount = view.maxSwapchainSampleCount = 1;
  return ReturnList<XrViewConfigurationView>(std::array{view, view}, room, count, out);
}

XrResult EnumerateEnvironmentBlendModes(XrInstance, XrSystemId, XrViewConfigurationType, uint32_t room, uint32_t* count,
                                        XrEnvironmentBlendMode* out) {
  return ReturnList<XrEnvironmentBlendMode>(
      std::array{XR_ENVIRONMENT_BLEND_MODE_ADDITIVE, XR_ENVIRONMENT_BLEND_MODE_OPAQUE}, room, count, out);
}

XrResult GetOpenGLGraphicsRequirementsKHR(XrInstance, XrSystemId, XrGraphicsRequirementsOpenGLKHR* needs) {
  Note("xrGetOpenGLGraphicsRequirementsKHR");
  needs->minApiVersionSupported = XR_MAKE_VERSION(3, 3, 0);
  needs->maxApiVersionSupported = XR_MAKE_VERSION(4, 6, 0);
  return XR_SUCCESS;
}

XrResult PollEvent(XrInstance, XrEventDataBuffer* event) {
  MockHeadset& mock = Mock();
  if (mock.events.empty()) return XR_EVENT_UNAVAILABLE;
  *event = mock.events.front();
  mock.events.pop_front();
  return XR_SUCCESS;
}

XrResult GetInstanceProcAddr(XrInstance, const char* name, PFN_xrVoidFunction* function) {
  static const std::unordered_map<std::string_view, PFN_xrVoidFunction> functions = [] {
    std::unordered_map<std::string_view, PFN_xrVoidFunction> table;
    const Function own[] = {
        LIKENESS_MOCK(GetInstanceProcAddr),
        LIKENESS_MOCK(EnumerateInstanceExtensionProperties),
        LIKENESS_MOCK(CreateInstance),
        LIKENESS_MOCK(DestroyInstance),
        LIKENESS_MOCK(GetInstanceProperties),
        LIKENESS_MOCK(GetSystem),
        LIKENESS_MOCK(EnumerateViewConfigurationViews),
        LIKENESS_MOCK(EnumerateEnvironmentBlendModes),
        LIKENESS_MOCK(GetOpenGLGraphicsRequirementsKHR),
        LIKENESS_MOCK(PollEvent),
    };
    for (const std::span<const Function> list :
         {std::span<const Function>(own), SessionFunctions(), SpaceFunctions(), PictureFunctions(), InputFunctions()}) {
      for (const Function& entry : list) table[entry.name] = entry.function;
    }
    return table;
  }();
  const auto found = functions.find(name);
  *function = found != functions.end() ? found->second : nullptr;
  return *function != nullptr ? XR_SUCCESS : XR_ERROR_FUNCTION_UNSUPPORTED;
}

// What loader and runtime agree on, as "OpenXR Loader - Design and Operation" lays it out; no installed header has it.
struct RuntimeRequest {
  uint32_t type, version;
  size_t size;
  uint32_t interface_version;
  XrVersion api_version;
  PFN_xrGetInstanceProcAddr get_instance_proc_addr;
};

}  // namespace
}  // namespace likeness::mock

extern "C" __attribute__((visibility("default"))) XrResult xrNegotiateLoaderRuntimeInterface(
    const void*, likeness::mock::RuntimeRequest* request) {
  request->interface_version = 1;
  request->api_version = XR_MAKE_VERSION(1, 0, 20);
  request->get_instance_proc_addr = likeness::mock::GetInstanceProcAddr;
  return XR_SUCCESS;
}
