// A whole file in memory without a copy: pages are read when they are touched.

#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>

namespace likeness {

// Read-only. Another program that shortens the file while it is mapped ends this one (SIGBUS), so keep the mapping for
// as long as it takes to read what is needed, and no longer.
class MappedFile {
 public:
  // Throws Error when the file is absent, is no regular file or cannot be mapped.
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::string_view bytes() const { return {static_cast<const char*>(data_), size_}; }

 private:
  void* data_ = nullptr;
  size_t size_ = 0;
};

}  // namespace likeness
