#include "likeness/texture/unwrap_state.h"

#include <fmt/format.h>

#include <algorithm>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/log.h"

namespace likeness {

namespace fs = std::filesystem;

void RemoveFolder(const fs::path& path) {
  std::error_code code;
  fs::remove_all(path, code);
  if (code && code != std::errc::not_a_directory) throw FileError(path, "cannot be removed: " + code.message());
}

UnwrapState::UnwrapState(const Capture& capture, const UnwrapOptions& options)
    : layout_(capture.root()), size_(options.size), path_(layout_.TextureFolder(size_) / "state.json") {
  wanted_ = {options.grazing_deg, options.use_masks, capture.split().training_cameras, ""};
}

void UnwrapState::Prepare(bool redo) {
  const fs::path folder = layout_.TextureFolder(size_);
  if (redo) {
    RemoveFolder(folder);
    RemoveFolder(layout_.TextureMaskFolder(size_));
  }
  const std::vector<std::string> names = ListFolder(folder);
  if (std::any_of(names.begin(), names.end(), [](const std::string& name) { return !name.starts_with('.'); })) {
    if (!Exists(path_)) {
      throw FileError(folder, "holds textures that another program made; --redo replaces them, --size avoids them");
    }
    Compare(folder);
  }
  WriteFile(path_, UnwrapRecordText(wanted_));
}

void UnwrapState::SetStatistics(const std::string& key) {
  wanted_.statistics = key;
  WriteFile(path_, UnwrapRecordText(wanted_));
}

void UnwrapState::Compare(const fs::path& folder) {
  const UnwrapRecord found = ReadRecord();
  if (found.grazing_deg != wanted_.grazing_deg || found.masks != wanted_.masks) {
    const auto spelt = [](const UnwrapRecord& record) {
      return fmt::format("--grazing {} --{}masks", record.grazing_deg, record.masks ? "" : "no-");
    };
    throw FileError(folder, fmt::format("was made with other options, {}; --redo makes it anew with {}", spelt(found),
                                        spelt(wanted_)));
  }
  if (found.training_cameras != wanted_.training_cameras) {
    LogInfo("the training cameras have changed: averages and statistics are made anew");
    for (const std::string& segment : ListFolder(folder)) RemoveFolder(folder / segment / "average");
  }
  wanted_.statistics = found.statistics;
}

UnwrapRecord UnwrapState::ReadRecord() const {
  try {
    return ParseUnwrapRecord(path_, ReadFile(path_));
  } catch (const Error& error) {
    throw Error("{}; the file is damaged: --redo makes the textures anew", error.what());
  }
}

}  // namespace likeness
