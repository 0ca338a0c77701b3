// Errors: Error is for the user to mend, LIKENESS_CHECK catches a mistake of ours.

#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>

namespace likeness {

// Something outside the program is wrong: a file, an option, the machine. The text says what, which path, what was
// expected and what to do. Caught in main and at thread and C boundaries only.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;

  template <typename... Args>
  requires(sizeof...(Args) > 0) explicit Error(fmt::format_string<Args...> format, Args&&... args)
      : std::runtime_error(fmt::format(format, std::forward<Args>(args)...)) {}
};

// An Error about one file: "PATH: MESSAGE", or "PATH:LINE: MESSAGE" with a 1-based line.
Error FileError(const std::filesystem::path& path, const std::string& message);
Error FileError(const std::filesystem::path& path, int line, const std::string& message);

namespace internal {
[[noreturn]] void CheckFailed(const char* condition, const char* file, int line);
}  // namespace internal

}  // namespace likeness

// Throws std::logic_error when the condition is false: a bug in this library or in its caller.
#define LIKENESS_CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::likeness::internal::CheckFailed(#condition, __FILE__, __LINE__))
