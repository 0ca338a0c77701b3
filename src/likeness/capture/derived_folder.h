// Folders that are made from a capture: never in it or around it, and made in one way alone.

#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace likeness {

// Absolute and without links, as far as it exists.
std::filesystem::path AbsolutePath(const std::filesystem::path& path);

// Throws Error where one of the two lies in the other.
void CheckApart(const std::filesystem::path& source, const std::filesystem::path& out);

// Writes OUT/RECORD, which says what the folder is made from, into an empty or new folder. Where the same record is
// there already, an earlier run is gone on with. Throws Error for a folder with another record, naming what differs,
// and for one that holds anything else.
//   made  "converted": for the message
void ClaimFolder(const std::filesystem::path& out, const std::string& record_name, const std::string& made,
                 const nlohmann::ordered_json& record);

}  // namespace likeness
