// What the viewer remembers from one time to the next.

#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/viewer/window.h"

namespace likeness {

struct ViewerSettings {
  WindowPlace place;
  bool dark = true;
  std::vector<std::filesystem::path> recent;  // avatars, the last one first

  // Puts an avatar first in the list.
  void Remember(const std::filesystem::path& avatar);
};

// viewer.json in $XDG_CONFIG_HOME/likeness, otherwise in ~/.config/likeness; empty where there is no home.
std::filesystem::path ViewerSettingsFile();

// The defaults when there is no file. Throws Error naming the file for anything else than SaveSettings wrote.
ViewerSettings LoadViewerSettings(const std::filesystem::path& file);
ViewerSettings ParseViewerSettings(const std::filesystem::path& path_for_errors, std::string_view text);

// Whole or not at all. Throws Error when it cannot be written.
void SaveViewerSettings(const std::filesystem::path& file, const ViewerSettings& settings);

}  // namespace likeness
