#include "likeness/base/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "likeness/base/log.h"

namespace likeness {
namespace {

std::mutex g_terminal;
bool g_bar_on_screen = false;  // guarded by g_terminal

bool IsTerminal() {
  static const bool is_terminal = isatty(STDERR_FILENO) == 1;
  return is_terminal;
}

double Seconds(std::chrono::steady_clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

}  // namespace

TerminalLock::TerminalLock() : lock_(g_terminal) {}

void TerminalLock::ClearBar() const {
  if (g_bar_on_screen) fmt::print(stderr, "\r\x1b[K");
  g_bar_on_screen = false;
}

Progress::Progress(std::string what, int64_t total, std::string unit)
    : what_(std::move(what)), total_(total), unit_(std::move(unit)), start_(Clock::now()), drawn_(start_) {}

Progress::~Progress() { Finish(); }

void Progress::Advance(int64_t units) {
  const std::lock_guard lock(mutex_);
  done_ += units;
  Draw(false);
}

void Progress::Skip(int64_t units) {
  const std::lock_guard lock(mutex_);
  skipped_ += units;
  Draw(false);
}

void Progress::Note(std::string note) {
  const std::lock_guard lock(mutex_);
  note_ = std::move(note);
}

void Progress::Finish() {
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  finished_ = true;
  Draw(true);
}

std::string Progress::Line() const {
  const double elapsed = Seconds(Clock::now() - start_);
  const int64_t done = done_ + skipped_;
  std::string line =
      total_ > 0 ? fmt::format("{} {}/{} {}", what_, done, total_, unit_) : fmt::format("{} {} {}", what_, done, unit_);
  if (done_ > 0 && elapsed > 0) {
    const double rate = static_cast<double>(done_) / elapsed;
    line += rate >= 0.095 ? fmt::format(", {:.1f}/s", rate) : fmt::format(", {:.1f} s each", 1 / rate);
    if (finished_) {
      line += ", took " + FormatDuration(elapsed);
    } else if (total_ > done) {
      line += fmt::format(", {} left", FormatDuration(static_cast<double>(total_ - done) / rate));
    }
  }
  if (!note_.empty()) line += ", " + note_;
  return line;
}

void Progress::Draw(bool last) {
  if (IsQuiet()) return;
  const auto now = Clock::now();
  if (!last && Seconds(now - drawn_) < (IsTerminal() ? 0.1 : 10.0)) return;
  drawn_ = now;
  const TerminalLock lock;
  lock.ClearBar();
  if (last || !IsTerminal()) {
    fmt::print(stderr, "{}\n", Line());
  } else {
    constexpr int kWidth = 24;
    const double share = total_ > 0 ? static_cast<double>(done_ + skipped_) / static_cast<double>(total_) : 0;
    const int filled = std::clamp(static_cast<int>(std::lround(share * kWidth)), 0, kWidth);
    fmt::print(stderr, "[{}{}] {}", std::string(filled, '#'), std::string(kWidth - filled, '.'), Line());
    g_bar_on_screen = true;
  }
  std::fflush(stderr);
}

std::string FormatDuration(double seconds) {
  const auto whole = static_cast<int64_t>(std::llround(std::max(seconds, 0.0)));
  if (whole >= 3600) return fmt::format("{} h {:02} min", whole / 3600, whole % 3600 / 60);
  if (whole >= 60) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} s", whole);
}

}  // namespace likeness
