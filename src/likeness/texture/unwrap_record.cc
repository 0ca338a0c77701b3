#include "likeness/texture/unwrap_record.h"

#include <nlohmann/json.hpp>

#include "likeness/base/error.h"
#include "likeness/base/json.h"

namespace likeness {

UnwrapRecord ParseUnwrapRecord(const std::filesystem::path& path_for_errors, std::string_view text) {
  try {
    const nlohmann::json root = ParseJson(path_for_errors, text);
    const nlohmann::json& textures = root.at("textures");
    return {textures.at("grazing_deg").get<double>(), textures.at("masks").get<bool>(),
            root.at("training_cameras").get<std::vector<std::string>>(),
            root.contains("statistics") ? root.at("statistics").get<std::string>() : ""};
  } catch (const nlohmann::json::exception& error) {
    throw FileError(path_for_errors, fmt::format("is no record of an unwrapping: {}", error.what()));
  }
}

std::string UnwrapRecordText(const UnwrapRecord& record) {
  nlohmann::ordered_json root;
  root["textures"] = {{"grazing_deg", record.grazing_deg}, {"masks", record.masks}};
  root["training_cameras"] = record.training_cameras;
  if (!record.statistics.empty()) root["statistics"] = record.statistics;
  return root.dump(2) + '\n';
}

}  // namespace likeness
