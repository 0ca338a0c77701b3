// The connection to an OpenXR runtime and to the headset that it drives.

#pragma once

#include <string>

#include "likeness/xr/api.h"

namespace likeness {

class VrRuntime {
 public:
  // Throws Error saying what to do when there is no runtime, when it does not answer, has no OpenGL or no headset.
  VrRuntime();

  XrInstance instance() const { return instance_.get(); }
  XrSystemId system() const { return system_; }
  const std::string& name() const { return name_; }  // of the runtime, with its version

 private:
  OwnedInstance instance_;
  XrSystemId system_ = XR_NULL_SYSTEM_ID;
  std::string name_;
};

}  // namespace likeness
