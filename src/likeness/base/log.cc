#include "likeness/base/log.h"

#include <atomic>
#include <cstdio>

#include "likeness/base/progress.h"

namespace likeness {
namespace {
std::atomic<bool> g_quiet = false;
}  // namespace

void SetQuiet(bool quiet) { g_quiet = quiet; }
bool IsQuiet() { return g_quiet; }

void internal::WriteLogLine(const std::string& line) {
  const TerminalLock lock;
  lock.ClearBar();
  fmt::print(stderr, "{}\n", line);
  std::fflush(stderr);
}

}  // namespace likeness
