#include "likeness/xr/graphics_binding.h"

#define XR_USE_GRAPHICS_API_OPENGL
#define XR_USE_PLATFORM_XLIB
#include <GL/glx.h>
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

#include "likeness/base/error.h"

namespace likeness {
namespace {

// None of GLX is linked: the window's library has loaded it where there is one.
template <typename Function>
Function* Load(const GlLoader& loader, const char* name) {
  auto* const function = reinterpret_cast<Function*>(loader(name));
  if (function == nullptr) throw Error("there is no {}: a headset is shown through OpenGL on X11", name);
  return function;
}
#define LIKENESS_GLX(name) Load<decltype(name)>(loader, #name)

}  // namespace

std::shared_ptr<const void> CurrentGraphicsBinding(const GlLoader& loader) {
  auto binding = std::make_shared<XrGraphicsBindingOpenGLXlibKHR>();
  binding->type = XR_TYPE_GRAPHICS_BINDING_OPENGL_XLIB_KHR;
  binding->xDisplay = LIKENESS_GLX(glXGetCurrentDisplay)();
  binding->glxContext = LIKENESS_GLX(glXGetCurrentContext)();
  binding->glxDrawable = LIKENESS_GLX(glXGetCurrentDrawable)();
  if (binding->xDisplay == nullptr || binding->glxContext == nullptr) {
    throw Error(
        "a headset is shown through OpenGL on X11, and the window is not of X11; under Wayland, run the program with "
        "XDG_SESSION_TYPE=x11 (Xwayland)");
  }
  int config_id = 0, screen = 0;
  LIKENESS_GLX(glXQueryContext)(binding->xDisplay, binding->glxContext, GLX_FBCONFIG_ID, &config_id);
  LIKENESS_GLX(glXQueryContext)(binding->xDisplay, binding->glxContext, GLX_SCREEN, &screen);
  const int wanted[] = {GLX_FBCONFIG_ID, config_id, 0};
  int count = 0;
  const std::unique_ptr<GLXFBConfig, int (*)(void*)> configs(
      LIKENESS_GLX(glXChooseFBConfig)(binding->xDisplay, screen, wanted, &count), XFree);
  if (configs == nullptr || count == 0) throw Error("GLX does not know the window's own configuration");
  binding->glxFBConfig = *configs;
  const std::unique_ptr<XVisualInfo, int (*)(void*)> visual(
      LIKENESS_GLX(glXGetVisualFromFBConfig)(binding->xDisplay, binding->glxFBConfig), XFree);
  if (visual != nullptr) binding->visualid = static_cast<uint32_t>(visual->visualid);
  return binding;
}

}  // namespace likeness
