// One bar for long work: done, rate, time left and a note such as the loss.

#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

namespace likeness {

// Writes to stderr: a bar that is redrawn where stderr is a terminal, otherwise a plain line every ten seconds and one
// at the end. Nothing with --quiet. Thread-safe.
class Progress {
 public:
  //   what   verb and object, "simulate frames"
  //   total  units of work; 0 when unknown
  //   unit   plural, "frames"
  Progress(std::string what, int64_t total, std::string unit);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // Adds units done now.
  void Advance(int64_t units = 1);
  // Adds units that an earlier run did: they count as done, not towards the rate.
  void Skip(int64_t units);
  // Replaces the text behind the bar.
  void Note(std::string note);
  // Draws the final state; the destructor does it otherwise.
  void Finish();

 private:
  std::string Line() const;
  void Draw(bool last);

  using Clock = std::chrono::steady_clock;
  const std::string what_;
  const int64_t total_;
  const std::string unit_;
  const Clock::time_point start_;
  std::mutex mutex_;
  Clock::time_point drawn_;
  int64_t done_ = 0;
  int64_t skipped_ = 0;
  std::string note_;
  bool finished_ = false;
};

// Holds stderr while a line is written.
class TerminalLock {
 public:
  TerminalLock();
  // Erases a bar that stands on the current line.
  void ClearBar() const;

 private:
  std::lock_guard<std::mutex> lock_;
};

// "1 h 02 min", "3 min 20 s", "12 s"
std::string FormatDuration(double seconds);

}  // namespace likeness
