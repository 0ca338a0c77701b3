#include "likeness/viewer/settings.h"

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/json.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostRecent = 8;
constexpr uint64_t kMostBytes = 1 << 20;
constexpr int kLeastSize = 200, kMostSize = 16384;  // of a window, in screen coordinates

}  // namespace

void ViewerSettings::Remember(const fs::path& avatar) {
  std::error_code failed;
  const fs::path whole = fs::absolute(avatar, failed);
  if (failed) return;
  recent.erase(std::remove(recent.begin(), recent.end(), whole), recent.end());
  recent.insert(recent.begin(), whole);
  if (recent.size() > kMostRecent) recent.resize(kMostRecent);
}

fs::path ViewerSettingsFile() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  // The specification says to ignore relative ones.
  if (config != nullptr && fs::path(config).is_absolute()) return fs::path(config) / "likeness" / "viewer.json";
  const char* home = std::getenv("HOME");
  if (home != nullptr && *home != '\0') return fs::path(home) / ".config" / "likeness" / "viewer.json";
  return {};
}

ViewerSettings LoadViewerSettings(const fs::path& file) {
  if (file.empty() || !Exists(file)) return {};
  return ParseViewerSettings(file, ReadFile(file, kMostBytes));
}

ViewerSettings ParseViewerSettings(const fs::path& path_for_errors, std::string_view text) {
  const nlohmann::json json = ParseJson(path_for_errors, text);
  ViewerSettings settings;
  try {
    const nlohmann::json& window = json.at("window");
    WindowPlace& place = settings.place;
    place.x = window.at("x").get<int>();
    place.y = window.at("y").get<int>();
    place.width = std::clamp(window.at("width").get<int>(), kLeastSize, kMostSize);
    place.height = std::clamp(window.at("height").get<int>(), kLeastSize, kMostSize);
    place.maximised = window.at("maximised").get<bool>();
    settings.dark = json.at("dark").get<bool>();
    for (const nlohmann::json& path : json.at("recent")) settings.recent.emplace_back(path.get<std::string>());
  } catch (const nlohmann::json::exception& error) {
    throw FileError(path_for_errors, fmt::format("does not hold the viewer's settings ({}); delete it", error.what()));
  }
  return settings;
}

void SaveViewerSettings(const fs::path& file, const ViewerSettings& settings) {
  const WindowPlace& place = settings.place;
  nlohmann::json json;
  json["window"] = {
      {"x", place.x}, {"y", place.y}, {"width", place.width}, {"height", place.height}, {"maximised", place.maximised}};
  json["dark"] = settings.dark;
  json["recent"] = nlohmann::json::array();
  for (const fs::path& path : settings.recent) json["recent"].push_back(path.string());
  // Paths need not be UTF-8.
  WriteFile(file, json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n", Sync::kNo);
}

}  // namespace likeness
