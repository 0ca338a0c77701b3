// Whose face a capture shows.

#pragma once

#include <filesystem>
#include <string>

#include "likeness/avatar/avatar.h"

namespace likeness {

// Index of the avatar's person whom the capture shows: of this name, or, where that is empty, the only one, or the one
// whom the capture's folder is named after. Throws Error naming the nearest one.
int CaptureIdentity(const Avatar& avatar, const std::string& name, const std::filesystem::path& capture);

}  // namespace likeness
