#include "likeness/base/error.h"
#include "likeness/base/log.h"
#include "likeness/viewer/viewer.h"

namespace likeness {
namespace {

constexpr int kFramesToLayOut = 3;  // Dear ImGui sizes panes by what was in them the frame before

ViewerSettings LoadedSettings(const std::filesystem::path& file) {
  try {
    return LoadViewerSettings(file);
  } catch (const Error& error) {
    LogWarning("{}; the window stands anew", error.what());
    return {};
  }
}

void SaveSettings(const std::filesystem::path& file, const ViewerSettings& settings) {
  if (file.empty()) return;
  try {
    SaveViewerSettings(file, settings);
  } catch (const Error& error) {
    LogWarning("{}; the window will stand anew the next time", error.what());
  }
}

}  // namespace

void RunViewer(ViewerOptions options) {
  const std::filesystem::path file = ViewerSettingsFile();
  ViewerSettings settings = LoadedSettings(file);
  options.window.place = settings.place;
  if (!options.dark) options.dark = settings.dark;
  options.recent = settings.recent;
  Viewer viewer(options);
  while (viewer.Frame()) continue;
  settings.place = viewer.window().place();
  settings.dark = viewer.state().dark;
  for (const std::filesystem::path& opened : viewer.opened_files()) settings.Remember(opened);
  SaveSettings(file, settings);
}

ImageU8 DrawViewer(const ViewerOptions& options) {
  Viewer viewer(options);
  ImageU8 picture;
  for (int settled = 0; settled < kFramesToLayOut;) {
    viewer.Frame(&picture);
    if (!viewer.state().message.empty()) throw Error("{}", viewer.state().message);
    settled = viewer.Settled() ? settled + 1 : 0;
  }
  return picture;
}

}  // namespace likeness
