// The pictures of one eye, which the headset's runtime owns and we draw.

#pragma once

#include <vector>

#include "likeness/gl/objects.h"
#include "likeness/xr/api.h"

namespace likeness {

class VrSwapchain {
 public:
  // Throws Error when the runtime has no pictures of sRGB-encoded colours.
  VrSwapchain(XrSession session, const GlFunctions& gl, const XrViewConfigurationView& view);

  XrSwapchain get() const { return swapchain_.get(); }
  int width() const { return width_; }
  int height() const { return height_; }

  // Waits for the next picture to be free. Until Release it is the colour of this framebuffer, whose values are
  // written as they are, sRGB-encoded (GL_FRAMEBUFFER_SRGB stays off); the runtime decodes them when it reads.
  GLuint Acquire();
  void Release();

 private:
  int width_, height_;
  OwnedSwapchain swapchain_;
  std::vector<GlFramebuffer> framebuffers_;  // one for each picture
};

}  // namespace likeness
