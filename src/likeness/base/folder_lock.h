// A folder for one process at a time.

#pragma once

#include <filesystem>

namespace likeness {

// Holds FOLDER/.lock, made with the folder where absent, until destroyed or until the process ends in whatever way.
// Throws Error when another process holds it.
class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

}  // namespace likeness
