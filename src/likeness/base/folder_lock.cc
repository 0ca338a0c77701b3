#include "likeness/base/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "likeness/base/error.h"

namespace likeness {

FolderLock::FolderLock(const std::filesystem::path& folder, Held held) {
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  if (code) throw FileError(folder, "cannot make this folder: " + code.message());
  const std::filesystem::path path = folder / ".lock";
  descriptor_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throw FileError(path, fmt::format("cannot be opened: {}", std::strerror(errno)));
  int reason = 0;
  do {
    if (flock(descriptor_, held == Held::kWait ? LOCK_EX : LOCK_EX | LOCK_NB) == 0) return;
    reason = errno;
  } while (reason == EINTR && held == Held::kWait);
  close(descriptor_);
  if (reason == EWOULDBLOCK)
    throw FileError(folder, "another process is writing there; wait for it, or name another folder");
  // Some network file systems know no locks: then nothing guards the folder.
  descriptor_ = -1;
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

}  // namespace likeness
