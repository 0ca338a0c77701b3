#include "likeness/base/error.h"

namespace likeness {

Error FileError(const std::filesystem::path& path, const std::string& message) {
  return Error("{}: {}", path.string(), message);
}

Error FileError(const std::filesystem::path& path, int line, const std::string& message) {
  return Error("{}:{}: {}", path.string(), line, message);
}

void internal::CheckFailed(const char* condition, const char* file, int line) {
  throw std::logic_error(
      fmt::format("internal error at {}:{}: {} does not hold; please report this", file, line, condition));
}

}  // namespace likeness
