// What tests share: scratch folders, and the sample data that stand beside the checkout on some machines.

#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace likeness {

// A folder of its own for one test, removed at the end.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

// A file or folder of the sample data: $LIKENESS_TEST_DATA/NAME, otherwise ../shared/data/NAME beside the checkout.
// None where it is absent; then skip: GTEST_SKIP() << "sample data absent".
std::optional<std::filesystem::path> SampleData(const std::string& name);

// The MakeHuman data that scripts/setup fetches: $LIKENESS_HEAD_DATA, otherwise .deps/head-data. None where absent.
std::optional<std::filesystem::path> HeadData();

// The text of the Error that `call` throws; "" when it throws none.
std::string ErrorOf(const std::function<void()>& call);

}  // namespace likeness
