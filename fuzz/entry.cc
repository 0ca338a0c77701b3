// libFuzzer's entry to a target.

#include <cstddef>
#include <cstdint>

#include "fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  likeness::fuzz::Run({reinterpret_cast<const char*>(data), size});
  return 0;
}
