// Finding the avatar file that a command means.

#pragma once

#include <filesystem>

namespace likeness {

// A file as it is; for the folder of a training run, the avatar.safetensors in it. Throws Error when there is none.
std::filesystem::path AvatarFile(const std::filesystem::path& path);

}  // namespace likeness
