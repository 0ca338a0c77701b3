#include "likeness/decode/c_interface.h"

#include <cstring>

namespace likeness {

namespace {

// Not a string: that could run out of memory while it tells of it.
constexpr size_t kMostText = 1024;
thread_local char last_error[kMostText] = "";

}  // namespace

const char* LastError() { return last_error; }

likeness_status Fail(likeness_status status, const char* text) {
  std::strncpy(last_error, text, kMostText - 1);
  return status;
}

}  // namespace likeness
