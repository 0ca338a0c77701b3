#include "likeness/xr/swapchain.h"

#include <algorithm>

#include "likeness/base/error.h"

namespace likeness {
namespace {

// A format without sRGB would be taken for linear light, and all would look pale.
int64_t SrgbFormat(XrSession session) {
  uint32_t count = 0;
  CheckXr(xrEnumerateSwapchainFormats(session, 0, &count, nullptr), "listing formats of pictures");
  std::vector<int64_t> formats(count);
  CheckXr(xrEnumerateSwapchainFormats(session, count, &count, formats.data()), "listing formats of pictures");
  for (const int64_t wanted : {GL_SRGB8_ALPHA8, GL_SRGB8}) {
    if (std::find(formats.begin(), formats.end(), wanted) != formats.end()) return wanted;
  }
  throw Error("the OpenXR runtime has no pictures in GL_SRGB8_ALPHA8 or GL_SRGB8; update it, or select another one");
}

}  // namespace

VrSwapchain::VrSwapchain(XrSession session, const GlFunctions& gl, const XrViewConfigurationView& view)
    : width_(static_cast<int>(view.recommendedImageRectWidth)),
      height_(static_cast<int>(view.recommendedImageRectHeight)) {
  auto info = Typed<XrSwapchainCreateInfo>(XR_TYPE_SWAPCHAIN_CREATE_INFO);
  info.usageFlags = XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT;
  info.format = SrgbFormat(session);
  info.sampleCount = 1;
  info.width = view.recommendedImageRectWidth;
  info.height = view.recommendedImageRectHeight;
  info.faceCount = info.arraySize = info.mipCount = 1;
  XrSwapchain made = XR_NULL_HANDLE;
  CheckXr(xrCreateSwapchain(session, &info, &made), "making an eye's pictures");
  swapchain_ = OwnedSwapchain(made);
  uint32_t count = 0;
  CheckXr(xrEnumerateSwapchainImages(made, 0, &count, nullptr), "listing an eye's pictures");
  std::vector<XrSwapchainImageOpenGLKHR> images(count,
                                                Typed<XrSwapchainImageOpenGLKHR>(XR_TYPE_SWAPCHAIN_IMAGE_OPENGL_KHR));
  auto* const base = reinterpret_cast<XrSwapchainImageBaseHeader*>(images.data());
  CheckXr(xrEnumerateSwapchainImages(made, count, &count, base), "listing an eye's pictures");
  for (const XrSwapchainImageOpenGLKHR& image : images) {
    const GlFramebuffer& framebuffer = framebuffers_.emplace_back(MakeFramebuffer(gl));
    gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, image.image, 0);
    if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
      throw Error("OpenGL ({}) cannot draw into the headset's pictures of {} x {}", gl.renderer, width_, height_);
    }
  }
  gl.BindFramebuffer(GL_FRAMEBUFFER, 0);
}

GLuint VrSwapchain::Acquire() {
  uint32_t index = 0;
  CheckXr(xrAcquireSwapchainImage(get(), nullptr, &index), "taking an eye's next picture");
  auto wait = Typed<XrSwapchainImageWaitInfo>(XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO);
  wait.timeout = XR_INFINITE_DURATION;
  CheckXr(xrWaitSwapchainImage(get(), &wait), "waiting for an eye's next picture");
  LIKENESS_CHECK(index < framebuffers_.size());
  return framebuffers_[index].id();
}

void VrSwapchain::Release() { CheckXr(xrReleaseSwapchainImage(get(), nullptr), "handing over an eye's picture"); }

}  // namespace likeness
