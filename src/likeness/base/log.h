// Messages for the person at the terminal. They go to stderr: stdout is for results.

#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

namespace likeness {

// With quiet, only warnings are written.
void SetQuiet(bool quiet);
bool IsQuiet();

namespace internal {
// Writes one line, clear of a progress bar that may be on the screen.
void WriteLogLine(const std::string& line);
}  // namespace internal

template <typename... Args>
void LogInfo(fmt::format_string<Args...> format, Args&&... args) {
  if (!IsQuiet()) internal::WriteLogLine(fmt::format(format, std::forward<Args>(args)...));
}

template <typename... Args>
void LogWarning(fmt::format_string<Args...> format, Args&&... args) {
  internal::WriteLogLine("warning: " + fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace likeness
