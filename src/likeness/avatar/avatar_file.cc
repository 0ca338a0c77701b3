#include "likeness/avatar/avatar_file.h"

#include "likeness/base/error.h"

namespace likeness {

std::filesystem::path AvatarFile(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) {
    if (std::filesystem::exists(path, ignored)) return path;
    throw FileError(path, "no such avatar; likeness train makes one");
  }
  const std::filesystem::path file = path / "avatar.safetensors";
  if (std::filesystem::exists(file, ignored)) return file;
  throw FileError(path, "holds no avatar.safetensors; has its training finished?");
}

}  // namespace likeness
