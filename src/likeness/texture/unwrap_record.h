// What the unwrapped textures of a folder were made with: state.json beside them.

#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace likeness {

struct UnwrapRecord {
  // Textures made with other values of these cannot stand in one folder.
  double grazing_deg = 0;
  bool masks = false;
  // Averages and statistics follow from these.
  std::vector<std::string> training_cameras;
  std::string statistics;  // names what the statistics were made from; "" while there are none

  bool operator==(const UnwrapRecord&) const = default;
};

// Throws Error naming the file for anything that UnwrapRecordText would not have written.
UnwrapRecord ParseUnwrapRecord(const std::filesystem::path& path_for_errors, std::string_view text);
std::string UnwrapRecordText(const UnwrapRecord& record);

}  // namespace likeness
