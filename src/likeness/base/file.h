// Whole files in and out of memory; output appears under its final name only when it is complete.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace likeness {

// Reads a whole file. Throws Error when it is absent, is no regular file, or is larger than `most` bytes.
std::string ReadFile(const std::filesystem::path& path, uint64_t most = uint64_t{1} << 32);

// The first `count` bytes of a file, or all of it when it is shorter.
std::string ReadFileStart(const std::filesystem::path& path, size_t count);

// Whether the bytes must be on disk before a file gets its final name. That takes milliseconds a file, so files that
// come by the thousand and can be made again do without; a crash of the machine (not of the program) may empty them.
enum class Sync { kYes, kNo };

// Writes beside the final name and renames when complete; makes missing folders.
void WriteFile(const std::filesystem::path& path, std::string_view bytes, Sync sync = Sync::kYes);

// The same for writers that want a path: `write` gets the temporary one (which ends like `path`).
void WriteFileWith(const std::filesystem::path& path, const std::function<void(const std::filesystem::path&)>& write,
                   Sync sync = Sync::kYes);

// Little-endian float32, as vertex binaries are. Throws Error unless the file holds exactly `count` finite values
// (count 0: any whole number of them).
std::vector<float> ReadFloats(const std::filesystem::path& path, size_t count = 0);
std::vector<float> ParseFloats(const std::filesystem::path& path_for_errors, std::string_view bytes, size_t count = 0);
void WriteFloats(const std::filesystem::path& path, std::span<const float> values);

// Whether there is something at a path; false where that cannot be told.
bool Exists(const std::filesystem::path& path);

// Names of what a folder holds, sorted; empty when it does not exist.
std::vector<std::string> ListFolder(const std::filesystem::path& folder);

}  // namespace likeness
