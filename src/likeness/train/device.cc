#include "likeness/train/device.h"

#include "likeness/base/error.h"

namespace likeness {

torch::Device FindDevice(const std::string& name, int local_rank) {
  if (name == "cpu") return torch::kCPU;
  if (name != "cuda" && name.rfind("cuda:", 0) != 0) throw Error("device '{}' is unknown; known are cpu, cuda", name);
  const int64_t count = at::hasCUDA() ? at::detail::getCUDAHooks().deviceCount() : 0;
  if (count == 0) throw Error("device '{}': LibTorch finds no CUDA GPU here; use --device cpu", name);
  const std::string digits = name == "cuda" ? std::to_string(local_rank) : name.substr(5);
  if (digits.empty() || digits.size() > 3 || digits.find_first_not_of("0123456789") != std::string::npos ||
      std::stoi(digits) >= count) {
    throw Error("device '{}' is not there; LibTorch finds {} CUDA GPUs, cuda:0 to cuda:{}", name, count, count - 1);
  }
  return {torch::kCUDA, static_cast<torch::DeviceIndex>(std::stoi(digits))};
}

}  // namespace likeness
