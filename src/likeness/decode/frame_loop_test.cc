// What decoding asks of the system once a decoder is open: nothing. Counted by replacing malloc, by the kernel's own
// count of page faults, and by a filter that ends the process at any other system call.

#include <gtest/gtest.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstddef>

#include "likeness/base/allocation_count.h"
#include "likeness/base/testing.h"
#include "likeness/decode/decoder.h"
#include "likeness/decode/kernels.h"
#include "likeness/decode/random_avatar.h"

#ifdef LIKENESS_COUNTS_ALLOCATIONS

namespace likeness {
namespace {

// All threads may yield and end, and read the clock where that takes a system call, and nothing else.
bool ForbidSystemCalls() {
  const auto allow = [](uint32_t number) { return sock_filter BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, number, 0, 1); };
  constexpr sock_filter kAllow = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  sock_filter filter[] = {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
                          allow(SYS_sched_yield),
                          kAllow,
                          allow(SYS_clock_gettime),
                          kAllow,
                          allow(SYS_exit_group),
                          kAllow,
                          BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS)};
  sock_fprog program = {static_cast<unsigned short>(std::size(filter)), filter};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_TSYNC, &program) == 0;
}

int64_t PageFaults() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

enum Exit { kQuiet = 0, kAllocates = 2, kFaults = 3, kNoFilter = 4 };

// In a process of its own: opens a decoder, decodes under the filter, and tells by its exit status what happened.
[[noreturn]] void DecodeQuietly(const std::string& file, const char* kernel, int threads) {
  DecoderOptions options;
  options.kernel = kernel;
  options.threads = threads;
  options.spin_ms = 60'000;  // own threads do not sleep meanwhile, whatever else the machine does
  const auto decoder = Decoder::Open(file, options);
  const int64_t row = decoder->architecture().texture_size * 4;
  std::vector<uint8_t> left(row * row / 4), right(row * row / 4);
  std::vector<float> vertices(decoder->architecture().vertex_count * 3), code(decoder->architecture().latent, 0.1f);
  const Decoder::View views[2] = {{{0, 0, 1}, left.data(), row}, {{0.6f, 0, 0.8f}, right.data(), row}};
  decoder->Decode(code, views, {vertices.data(), 12});
  const int64_t faults = PageFaults(), before = AllocationCount();
  for (int i = 0; i < 5; ++i) decoder->Decode(code, views, {vertices.data(), 12});
  const bool allocates = AllocationCount() != before, faulted = PageFaults() != faults;
  if (allocates) _exit(kAllocates);
  if (faulted) _exit(kFaults);
  if (!ForbidSystemCalls()) _exit(kNoFilter);
  for (int i = 0; i < 5; ++i) decoder->Decode(code, views, {vertices.data(), 12});
  _exit(kQuiet);
}

TEST(FrameLoop, AsksNothingOfTheSystem) {
  Architecture a;
  a.texture_size = 128;
  a.vertex_count = 700;
  a.latent = 16;
  const ScratchFolder folder;
  SaveAvatar(folder / "a.safetensors", RandomAvatar(a, 1));
  const std::string file = (folder / "a.safetensors").string();
  for (const Kernel* kernel : AvailableKernels()) {
    for (const int threads : {1, 2}) {
      const pid_t child = fork();
      ASSERT_GE(child, 0);
      if (child == 0) DecodeQuietly(file, kernel->name, threads);
      int status = 0;
      waitpid(child, &status, 0);
      if (WIFEXITED(status) && WEXITSTATUS(status) == kNoFilter) GTEST_SKIP() << "this system has no filters";
      ASSERT_FALSE(WIFSIGNALED(status)) << kernel->name << ", " << threads << " threads: a system call";
      EXPECT_EQ(WEXITSTATUS(status), kQuiet) << kernel->name << ", " << threads << " threads";
    }
  }
}

}  // namespace
}  // namespace likeness

#endif
