#include "likeness/render/raster_kernels.h"

#include <fmt/ranges.h>

#include "likeness/base/error.h"

namespace likeness {

#if defined(__x86_64__)
extern const RasterKernel kRasterKernel_avx512;
extern const RasterKernel kRasterKernel_avx2;
#endif
extern const RasterKernel kRasterKernel_portable;

std::vector<const RasterKernel*> AvailableRasterKernels() {
  std::vector<const RasterKernel*> available;
#if defined(__x86_64__)
  for (const RasterKernel* kernel : {&kRasterKernel_avx512, &kRasterKernel_avx2}) {
    if (kernel->available()) available.push_back(kernel);
  }
#endif
  available.push_back(&kRasterKernel_portable);
  return available;
}

const RasterKernel& FindRasterKernel(const std::string& name) {
  const std::vector<const RasterKernel*> available = AvailableRasterKernels();
  if (name == "auto") return *available.front();
  std::vector<std::string> names;
  for (const RasterKernel* kernel : available) {
    if (name == kernel->name) return *kernel;
    names.emplace_back(kernel->name);
  }
  throw Error("there is no kernel '{}' for drawing here; this processor runs auto, {}", name, fmt::join(names, ", "));
}

}  // namespace likeness
