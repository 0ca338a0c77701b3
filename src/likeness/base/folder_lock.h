// A folder for one process at a time.

#pragma once

#include <filesystem>

namespace likeness {

// Holds FOLDER/.lock, made with the folder where absent, until destroyed or until the process ends in whatever way.
// When another process holds it, throws Error or waits until it does not.
class FolderLock {
 public:
  enum class Held { kThrow, kWait };
  explicit FolderLock(const std::filesystem::path& folder, Held held = Held::kThrow);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

}  // namespace likeness
