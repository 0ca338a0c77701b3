// OpenGL's functions as a table, loaded through whatever knows their addresses: EGL for offscreen contexts, a window's
// library, or a caller of the C library. A table of our own rather than libepoxy or GLEW, because liblikeness.so may
// need no OpenGL library, and so that there is one way for all.
//
// Include this in place of GL/gl.h. A function that is missing here is added by its name to one of the two lists.

#pragma once

#define GL_GLEXT_PROTOTYPES  // for their types alone
#include <GL/glcorearb.h>

#include <functional>
#include <string>

namespace likeness {

// In every context of the core profile, 3.3 and newer; and those that 4.3 adds for compute shaders.
// clang-format off
#define LIKENESS_GL_3_3(F)                                                                              \
  F(ActiveTexture) F(AttachShader) F(BindBuffer) F(BindBufferBase) F(BindFramebuffer) F(BindTexture)    \
  F(BindVertexArray) F(BlendFunc) F(BlitFramebuffer) F(BufferData) F(BufferSubData)                     \
  F(CheckFramebufferStatus) F(Clear) F(ClearColor) F(ColorMask) F(CompileShader) F(CreateProgram)       \
  F(CreateShader) F(CullFace) F(DeleteBuffers) F(DeleteFramebuffers) F(DeleteProgram) F(DeleteQueries)  \
  F(DeleteShader) F(DeleteTextures) F(DeleteVertexArrays) F(DepthFunc) F(DetachShader) F(Disable)       \
  F(DrawArrays) F(DrawElements) F(Enable) F(EnableVertexAttribArray) F(Finish) F(FramebufferTexture2D)  \
  F(FrontFace) F(GenBuffers) F(GenFramebuffers) F(GenQueries) F(GenTextures) F(GenVertexArrays)         \
  F(GenerateMipmap) F(GetBufferSubData) F(GetError) F(GetInteger64v) F(GetIntegerv)                     \
  F(GetProgramInfoLog) F(GetProgramiv) F(GetQueryObjectui64v) F(GetShaderInfoLog) F(GetShaderiv)        \
  F(GetString) F(GetTexImage) F(GetUniformLocation) F(LinkProgram) F(MapBufferRange) F(PolygonMode)     \
  F(PolygonOffset) F(QueryCounter) F(ReadPixels) F(ShaderSource) F(TexImage2D)                          \
  F(TexImage2DMultisample) F(TexParameteri) F(TexSubImage2D) F(Uniform1f) F(Uniform1i) F(Uniform3f)     \
  F(UniformMatrix4fv) F(UnmapBuffer) F(UseProgram) F(VertexAttribPointer) F(Viewport)
#define LIKENESS_GL_4_3(F) \
  F(BindImageTexture) F(DispatchCompute) F(MemoryBarrier)
// clang-format on

// The address of a function by its full name, "glGetString"; null where there is none.
using GlLoader = std::function<void*(const char* name)>;

// Of one context, which is current in the thread that calls them.
struct GlFunctions {
  // Of the context that is current in this thread. Throws Error when there is none, when it is older than
  // `major`.`minor` (3.3 or more), and when a function is missing.
  GlFunctions(const GlLoader& loader, int major, int minor);

#define LIKENESS_GL_DECLARE(name) decltype(&::gl##name) name = nullptr;  // NOLINT(bugprone-macro-parentheses)
  LIKENESS_GL_3_3(LIKENESS_GL_DECLARE)
  LIKENESS_GL_4_3(LIKENESS_GL_DECLARE)  // null in older contexts
#undef LIKENESS_GL_DECLARE

  int major_version = 0;
  int minor_version = 0;
  std::string renderer;  // the device and its driver, as the driver calls them

  bool AtLeast(int major, int minor) const {
    return major_version > major || (major_version == major && minor_version >= minor);
  }
};

// Throws Error when OpenGL has reported an error since it was last asked, such as a lack of memory, while `what` was
// done: "uploading weights". Waits for the driver: not for every frame.
void CheckGlErrors(const GlFunctions& gl, const std::string& what);

}  // namespace likeness
