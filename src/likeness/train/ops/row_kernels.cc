#include "likeness/train/ops/row_kernels.h"

namespace likeness {

#if defined(__x86_64__)
extern const RowKernels kRowKernels_avx2;
extern const RowKernels kRowKernels_avx512;
extern const RowKernels kRowKernels_amx;
bool PermitAmx();
#endif
extern const RowKernels kRowKernels_portable;

namespace {

struct Candidate {
  const RowKernels* kernels;
  bool available;
};

// From plain to fast.
std::vector<Candidate> Candidates() {
  std::vector<Candidate> all = {{&kRowKernels_portable, true}};
#if defined(__x86_64__)
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  all.push_back({&kRowKernels_avx2, avx2});
  all.push_back({&kRowKernels_avx512, avx512});
  all.push_back({&kRowKernels_amx, avx512 && PermitAmx()});
#endif
  return all;
}

const RowKernels* Best(int element_bytes) {
  const RowKernels* best = nullptr;
  for (const Candidate& one : Candidates()) {
    if (one.available && one.kernels->element_bytes == element_bytes) best = one.kernels;
  }
  return best;
}

}  // namespace

const RowKernels& FloatRowKernels() {
  static const RowKernels* const best = Best(4);
  return *best;
}

const RowKernels* Bfloat16RowKernels() {
  static const RowKernels* const best = Best(2);
  return best;
}

std::vector<const RowKernels*> AvailableRowKernels(std::vector<const char*>* missing) {
  std::vector<const RowKernels*> available;
  for (const Candidate& one : Candidates()) {
    if (one.available) available.push_back(one.kernels);
    if (!one.available && missing != nullptr) missing->push_back(one.kernels->name);
  }
  return available;
}

}  // namespace likeness
