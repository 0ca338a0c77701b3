#include "likeness/gl/functions.h"

#include "likeness/base/error.h"

namespace likeness {

namespace {

template <typename Function>
void LoadFunction(const GlLoader& loader, const char* name, Function* function) {
  *function = reinterpret_cast<Function>(loader(name));
  if (*function == nullptr) throw Error("the OpenGL driver has no function {}; update it, or use another one", name);
}

std::string ErrorName(GLenum error) {
  switch (error) {
    case GL_INVALID_ENUM:
      return "an invalid enumerator";
    case GL_INVALID_VALUE:
      return "an invalid value";
    case GL_INVALID_OPERATION:
      return "an invalid operation";
    case GL_INVALID_FRAMEBUFFER_OPERATION:
      return "an incomplete framebuffer";
    case GL_OUT_OF_MEMORY:
      return "that its memory does not suffice";
    default:
      return fmt::format("error {:#x}", error);
  }
}

}  // namespace

GlFunctions::GlFunctions(const GlLoader& loader, int major, int minor) {
#define LIKENESS_GL_LOAD(name) LoadFunction(loader, "gl" #name, &(name));
  LIKENESS_GL_3_3(LIKENESS_GL_LOAD)
  GetIntegerv(GL_MAJOR_VERSION, &major_version);
  GetIntegerv(GL_MINOR_VERSION, &minor_version);
  const GLubyte* const text = GetString(GL_RENDERER);
  if (major_version == 0 || text == nullptr)
    throw Error("no OpenGL context is current in this thread; make one current");
  renderer = reinterpret_cast<const char*>(text);
  if (!AtLeast(major, minor)) {
    throw Error("this OpenGL context is of version {}.{} ({}); expected {}.{} or newer", major_version, minor_version,
                renderer, major, minor);
  }
  if (AtLeast(4, 3)) {
    LIKENESS_GL_4_3(LIKENESS_GL_LOAD)
  }
#undef LIKENESS_GL_LOAD
}

void CheckGlErrors(const GlFunctions& gl, const std::string& what) {
  const GLenum error = gl.GetError();
  if (error == GL_NO_ERROR) return;
  while (gl.GetError() != GL_NO_ERROR) continue;
  throw Error("OpenGL ({}) reports {} while {}", gl.renderer, ErrorName(error), what);
}

}  // namespace likeness
