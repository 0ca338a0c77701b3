#include "likeness/gl/offscreen.h"

#define EGL_EGLEXT_PROTOTYPES  // for their types alone
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>

#include <string_view>
#include <vector>

#include "likeness/base/error.h"

namespace likeness {

namespace {

// clang-format off
#define LIKENESS_EGL(F) \
  F(BindAPI) F(CreateContext) F(DestroyContext) F(GetCurrentContext) F(GetError) F(GetPlatformDisplayEXT) \
  F(Initialize) F(MakeCurrent) F(QueryDevicesEXT) F(QueryString)
// clang-format on

// Some are null where EGL lacks an extension.
struct EglFunctions {
#define LIKENESS_EGL_DECLARE(name) decltype(&::egl##name) name = nullptr;  // NOLINT(bugprone-macro-parentheses)
  LIKENESS_EGL(LIKENESS_EGL_DECLARE)
#undef LIKENESS_EGL_DECLARE
};

EglFunctions LoadEgl() {
  EglFunctions egl;
#define LIKENESS_EGL_LOAD(name) \
  egl.name = reinterpret_cast<decltype(egl.name)>(OffscreenContext::FunctionAddress("egl" #name));
  LIKENESS_EGL(LIKENESS_EGL_LOAD)
#undef LIKENESS_EGL_LOAD
  if (egl.QueryString == nullptr || egl.GetPlatformDisplayEXT == nullptr) {
    throw Error("no offscreen OpenGL: libEGL.so.1 is absent or too old; install it (Debian: libegl1 libgl1-mesa-dri)");
  }
  return egl;
}

bool Lists(const char* names, std::string_view name) {
  const std::string_view all = names != nullptr ? names : "";
  for (size_t at = all.find(name); at != std::string_view::npos; at = all.find(name, at + 1)) {
    const size_t end = at + name.size();
    if ((at == 0 || all[at - 1] == ' ') && (end == all.size() || all[end] == ' ')) return true;
  }
  return false;
}

// Graphics cards first, as EGL puts them; then Mesa without a device.
std::vector<EGLDisplay> Displays(const EglFunctions& egl) {
  const char* const extensions = egl.QueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  std::vector<EGLDisplay> displays;
  if (egl.QueryDevicesEXT != nullptr && Lists(extensions, "EGL_EXT_platform_device")) {
    EGLint count = 0;
    if (egl.QueryDevicesEXT(0, nullptr, &count) == EGL_FALSE) count = 0;
    std::vector<EGLDeviceEXT> devices(static_cast<size_t>(count));
    if (count > 0) egl.QueryDevicesEXT(count, devices.data(), &count);
    for (const EGLDeviceEXT device : devices) {
      displays.push_back(egl.GetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr));
    }
  }
  if (Lists(extensions, "EGL_MESA_platform_surfaceless")) {
    displays.push_back(egl.GetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr));
  }
  return displays;
}

// The context, or null with the reason.
EGLContext ContextOf(const EglFunctions& egl, EGLDisplay display, int major, int minor, std::string* reason) {
  // A display is shared by the whole process and never terminated, since that would take it from others.
  if (display == EGL_NO_DISPLAY || egl.Initialize(display, nullptr, nullptr) == EGL_FALSE) {
    *reason = "cannot be used by this process";
    return EGL_NO_CONTEXT;
  }
  const char* const extensions = egl.QueryString(display, EGL_EXTENSIONS);
  if (!Lists(extensions, "EGL_KHR_surfaceless_context") || !Lists(extensions, "EGL_KHR_no_config_context") ||
      egl.BindAPI(EGL_OPENGL_API) == EGL_FALSE) {
    *reason = "has no OpenGL without a window";
    return EGL_NO_CONTEXT;
  }
  const EGLint attributes[] = {
      EGL_CONTEXT_MAJOR_VERSION,           major,   EGL_CONTEXT_MINOR_VERSION, minor, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  const EGLContext context = egl.CreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
  if (context == EGL_NO_CONTEXT) *reason = fmt::format("has no OpenGL {}.{}", major, minor);
  return context;
}

}  // namespace

void* OffscreenContext::FunctionAddress(const char* name) {
  // Stays loaded: drivers do not bear to be unloaded.
  static void* const library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
  static void* const get = library != nullptr ? dlsym(library, "eglGetProcAddress") : nullptr;
  if (get == nullptr) return nullptr;
  return reinterpret_cast<void*>(reinterpret_cast<decltype(&eglGetProcAddress)>(get)(name));
}

OffscreenContext::OffscreenContext(int major, int minor) : OffscreenContext() {
  const EglFunctions egl = LoadEgl();
  std::string reasons;
  int number = 0;
  for (const EGLDisplay display : Displays(egl)) {
    std::string reason;
    context_ = ContextOf(egl, display, major, minor, &reason);
    if (context_ != EGL_NO_CONTEXT) {
      display_ = display;
      break;
    }
    reasons += fmt::format("{}display {} {}", reasons.empty() ? "" : ", ", ++number, reason);
  }
  if (context_ == EGL_NO_CONTEXT) {
    throw Error("no offscreen OpenGL {}.{}: {}; install a driver that has it (Debian: libgl1-mesa-dri)", major, minor,
                reasons.empty() ? "EGL has no displays" : reasons);
  }
  MakeCurrent();
  gl_.emplace(FunctionAddress, major, minor);
}

OffscreenContext::~OffscreenContext() {
  if (context_ == EGL_NO_CONTEXT) return;
  const EglFunctions egl = LoadEgl();
  if (egl.GetCurrentContext() == context_) {
    egl.MakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }
  egl.DestroyContext(display_, context_);
}

void OffscreenContext::MakeCurrent() const {
  const EglFunctions egl = LoadEgl();
  if (egl.MakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_FALSE) {
    throw Error("EGL cannot make an offscreen OpenGL context current: error {:#x}", egl.GetError());
  }
}

}  // namespace likeness
