#include "likeness/decode/kernels.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "likeness/base/error.h"

namespace likeness {

#if defined(__x86_64__)
extern const Kernel kKernel_amx;
extern const Kernel kKernel_avx512_vnni;
extern const Kernel kKernel_avx512;
extern const Kernel kKernel_avx2_int16;
extern const Kernel kKernel_avx2;
#endif
extern const Kernel kKernel_portable;

const std::vector<const Kernel*>& AllKernels() {
  static const std::vector<const Kernel*> all = {
#if defined(__x86_64__)
    &kKernel_amx,
    &kKernel_avx512_vnni,
    &kKernel_avx512,
    &kKernel_avx2_int16,
    &kKernel_avx2,
#endif
    &kKernel_portable
  };
  return all;
}

std::vector<const Kernel*> AvailableKernels() {
  std::vector<const Kernel*> available;
  std::copy_if(AllKernels().begin(), AllKernels().end(), std::back_inserter(available),
               [](const Kernel* kernel) { return kernel->available(); });
  return available;
}

const Kernel& FindKernel(const std::string& name) {
  std::vector<std::string> names;
  for (const Kernel* kernel : AllKernels()) {
    if (kernel->available()) names.emplace_back(kernel->name);
    if (name != kernel->name) continue;
    if (kernel->available()) return *kernel;
    throw Error("this processor cannot run the kernel '{}'", name);
  }
  throw Error("there is no kernel '{}'; this processor runs auto, {}", name, fmt::join(names, ", "));
}

}  // namespace likeness
