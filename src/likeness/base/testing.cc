#include "likeness/base/testing.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>

#include "likeness/base/error.h"

namespace likeness {

namespace fs = std::filesystem;

namespace {

std::optional<fs::path> Existing(const fs::path& path) { return fs::exists(path) ? std::optional(path) : std::nullopt; }

}  // namespace

ScratchFolder::ScratchFolder() {
  static std::atomic<int> counter = 0;
  path_ = fs::temp_directory_path() / fmt::format("likeness-test-{}-{}", getpid(), counter++);
  fs::create_directories(path_);
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::optional<fs::path> SampleData(const std::string& name) {
  if (const char* folder = std::getenv("LIKENESS_TEST_DATA")) return Existing(fs::path(folder) / name);
  return Existing(fs::path(LIKENESS_SOURCE_DIR) / ".." / "shared" / "data" / name);
}

std::optional<fs::path> HeadData() {
  if (const char* folder = std::getenv("LIKENESS_HEAD_DATA")) return Existing(folder);
  return Existing(fs::path(LIKENESS_SOURCE_DIR) / ".deps" / "head-data");
}

std::string ErrorOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace likeness
