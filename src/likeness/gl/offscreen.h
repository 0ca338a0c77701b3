// An OpenGL context without a window, by EGL: for tests, servers and benchmarks. On a graphics card where there is one
// that this process may use, otherwise on Mesa's llvmpipe.

#pragma once

#include <optional>

#include "likeness/gl/functions.h"

namespace likeness {

class OffscreenContext {
 public:
  // Of the core profile, of this version or one that is newer; at least 3.3. Current in the calling thread, which is
  // the only one to use and to destroy it. libEGL is loaded now, so that programs start without it. Throws Error saying
  // what was tried when there is no such context on this machine.
  OffscreenContext(int major, int minor);
  ~OffscreenContext();
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;

  const GlFunctions& gl() const { return *gl_; }
  void MakeCurrent() const;  // again, after another one was

  // The address of one of EGL's or OpenGL's functions; null where there is none.
  static void* FunctionAddress(const char* name);

 private:
  OffscreenContext() = default;

  void* display_ = nullptr;
  void* context_ = nullptr;
  std::optional<GlFunctions> gl_;
};

}  // namespace likeness
