// Swapchains: textures in the program's own context, which is current in all of these calls.

#include <dlfcn.h>

#include <algorithm>
#include <map>
#include <memory>

#include "likeness/gl/objects.h"
#include "likeness/xr/mock/mock_calls.h"

namespace likeness::mock {
namespace {

constexpr int kImages = 3;

struct Swapchain {
  std::vector<GlTexture> images;
  int width = 0, height = 0;
  int next = 0, held = -1, last = -1;
  bool waited = false;
};

std::map<XrSwapchain, Swapchain> swapchains;

const GlFunctions& Gl() {
  static const GlFunctions gl(
      [](const char* name) {
        static void* const library = dlopen("libGL.so.1", RTLD_NOW | RTLD_LOCAL);
        static const auto get = reinterpret_cast<void* (*)(const char*)>(dlsym(library, "glXGetProcAddressARB"));
        return get(name);
      },
      3, 3);
  return gl;
}

std::vector<int64_t> Formats() {
  return Mock().formats.empty() ? std::vector<int64_t>{GL_RGBA16F, GL_SRGB8_ALPHA8, GL_RGBA8} : Mock().formats;
}

XrResult EnumerateSwapchainFormats(XrSession, uint32_t room, uint32_t* count, int64_t* out) {
  LIKENESS_MOCK_SESSION_CALL("xrEnumerateSwapchainFormats");
  return ReturnList<int64_t>(Formats(), room, count, out);
}

XrResult CreateSwapchain(XrSession, const XrSwapchainCreateInfo* info, XrSwapchain* swapchain) {
  LIKENESS_MOCK_SESSION_CALL("xrCreateSwapchain");
  const std::vector<int64_t> formats = Formats();
  if (std::find(formats.begin(), formats.end(), info->format) == formats.end()) {
    return XR_ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED;
  }
  *swapchain = NextHandle<XrSwapchain>();
  Swapchain& made = swapchains[*swapchain];
  made.width = static_cast<int>(info->width);
  made.height = static_cast<int>(info->height);
  for (int i = 0; i < kImages; ++i) {
    made.images.push_back(MakeTexture(Gl(), static_cast<GLenum>(info->format), made.width, made.height));
  }
  return XR_SUCCESS;
}

XrResult DestroySwapchain(XrSwapchain swapchain) {
  Note("xrDestroySwapchain");
  return swapchains.erase(swapchain) == 1 ? XR_SUCCESS : XR_ERROR_HANDLE_INVALID;
}

XrResult EnumerateSwapchainImages(XrSwapchain swapchain, uint32_t room, uint32_t* count,
                                  XrSwapchainImageBaseHeader* out) {
  LIKENESS_MOCK_SESSION_CALL("xrEnumerateSwapchainImages");
  *count = kImages;
  auto* const images = reinterpret_cast<XrSwapchainImageOpenGLKHR*>(out);
  for (size_t i = 0; i < room && i < kImages; ++i) images[i].image = swapchains.at(swapchain).images[i].id();
  return XR_SUCCESS;
}

XrResult AcquireSwapchainImage(XrSwapchain swapchain, const XrSwapchainImageAcquireInfo*, uint32_t* index) {
  LIKENESS_MOCK_SESSION_CALL("xrAcquireSwapchainImage");
  Swapchain& chain = swapchains.at(swapchain);
  if (chain.held >= 0) return XR_ERROR_CALL_ORDER_INVALID;
  chain.held = chain.next;
  chain.next = (chain.next + 1) % kImages;
  chain.waited = false;
  *index = static_cast<uint32_t>(chain.held);
  return XR_SUCCESS;
}

XrResult WaitSwapchainImage(XrSwapchain swapchain, const XrSwapchainImageWaitInfo*) {
  LIKENESS_MOCK_SESSION_CALL("xrWaitSwapchainImage");
  Swapchain& chain = swapchains.at(swapchain);
  if (chain.held < 0 || chain.waited) return XR_ERROR_CALL_ORDER_INVALID;
  chain.waited = true;
  return XR_SUCCESS;
}

XrResult ReleaseSwapchainImage(XrSwapchain swapchain, const XrSwapchainImageReleaseInfo*) {
  LIKENESS_MOCK_SESSION_CALL("xrReleaseSwapchainImage");
  Swapchain& chain = swapchains.at(swapchain);
  if (!chain.waited) return XR_ERROR_CALL_ORDER_INVALID;
  chain.last = chain.held;
  chain.held = -1;
  chain.waited = false;
  return XR_SUCCESS;
}

}  // namespace

ImageU8 LastPicture(XrSwapchain swapchain) {
  const Swapchain& chain = swapchains.at(swapchain);
  const std::vector<uint8_t> rgba =
      ReadTexture(Gl(), chain.images[static_cast<size_t>(chain.last)].id(), chain.width, chain.height);
  ImageU8 picture(chain.width, chain.height, 3);
  for (int y = 0; y < chain.height; ++y) {
    const uint8_t* row = rgba.data() + static_cast<size_t>(chain.height - 1 - y) * chain.width * 4;  // from below
    for (int x = 0; x < chain.width; ++x) std::copy_n(row + 4 * x, 3, picture.at(x, y));
  }
  return picture;
}

std::span<const Function> PictureFunctions() {
  static const Function functions[] = {
      LIKENESS_MOCK(EnumerateSwapchainFormats), LIKENESS_MOCK(CreateSwapchain),       LIKENESS_MOCK(DestroySwapchain),
      LIKENESS_MOCK(EnumerateSwapchainImages),  LIKENESS_MOCK(AcquireSwapchainImage), LIKENESS_MOCK(WaitSwapchainImage),
      LIKENESS_MOCK(ReleaseSwapchainImage)};
  return functions;
}

}  // namespace likeness::mock
