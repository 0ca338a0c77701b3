#include "likeness/base/file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>

#include "likeness/base/error.h"

namespace likeness {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "binary files are little-endian");

namespace {

// The size of a regular file; throws Error for anything else.
uint64_t FileSize(const fs::path& path) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) throw FileError(path, "no such file");
  if (!fs::is_regular_file(status)) throw FileError(path, "expected a file, found something else (a folder?)");
  const uint64_t size = fs::file_size(path, code);
  if (code) throw FileError(path, "cannot be read: " + code.message());
  return size;
}

std::string ReadBytes(const fs::path& path, uint64_t count) {
  std::ifstream in(path, std::ios::binary);
  std::string bytes(count, '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(count));
  if (!in || static_cast<uint64_t>(in.gcount()) != count) {
    throw FileError(path, fmt::format("cannot be read: {}", std::strerror(errno)));
  }
  return bytes;
}

}  // namespace

std::string ReadFile(const fs::path& path, uint64_t most) {
  const uint64_t size = FileSize(path);
  if (size > most) throw FileError(path, fmt::format("is {} bytes large; at most {} were expected", size, most));
  return ReadBytes(path, size);
}

std::string ReadFileStart(const fs::path& path, size_t count) {
  return ReadBytes(path, std::min<uint64_t>(count, FileSize(path)));
}

void WriteFile(const fs::path& path, std::string_view bytes, Sync sync) {
  WriteFileWith(
      path,
      [&](const fs::path& temporary) {
        std::ofstream out(temporary, std::ios::binary);
        out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        out.close();
        if (!out) throw FileError(path, fmt::format("cannot be written: {}", std::strerror(errno)));
      },
      sync);
}

void WriteFileWith(const fs::path& path, const std::function<void(const fs::path&)>& write, Sync sync) {
  static std::atomic<int> counter = 0;
  std::error_code code;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), code);
  if (code) throw FileError(path.parent_path(), "cannot make this folder: " + code.message());
  const fs::path temporary = path.parent_path() / fmt::format(".{}.{}.{}.partial{}", path.stem().string(), getpid(),
                                                              counter++, path.extension().string());
  try {
    write(temporary);
    if (sync == Sync::kYes) {
      const int descriptor = open(temporary.c_str(), O_RDONLY | O_CLOEXEC);
      if (descriptor >= 0) {
        fdatasync(descriptor);
        close(descriptor);
      }
    }
    fs::rename(temporary, path);
  } catch (const fs::filesystem_error& error) {
    fs::remove(temporary, code);
    throw FileError(path, "cannot be written: " + error.code().message());
  } catch (...) {
    fs::remove(temporary, code);
    throw;
  }
}

std::vector<float> ReadFloats(const fs::path& path, size_t count) { return ParseFloats(path, ReadFile(path), count); }

std::vector<float> ParseFloats(const fs::path& path_for_errors, std::string_view bytes, size_t count) {
  if (bytes.size() % sizeof(float) != 0 || (count != 0 && bytes.size() != count * sizeof(float))) {
    throw FileError(path_for_errors,
                    count != 0 ? fmt::format("is {} bytes long; expected {} float32 values, {} bytes", bytes.size(),
                                             count, count * sizeof(float))
                               : fmt::format("is {} bytes long, not a whole number of float32", bytes.size()));
  }
  std::vector<float> values(bytes.size() / sizeof(float));
  std::copy(bytes.begin(), bytes.end(), reinterpret_cast<char*>(values.data()));
  const auto bad = std::find_if_not(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
  if (bad != values.end()) {
    throw FileError(path_for_errors, fmt::format("value {} is not a finite number", bad - values.begin()));
  }
  return values;
}

void WriteFloats(const fs::path& path, std::span<const float> values) {
  WriteFile(path, {reinterpret_cast<const char*>(values.data()), values.size_bytes()});
}

bool Exists(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

std::vector<std::string> ListFolder(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code code;
  for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    names.push_back(it->path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace likeness
