#include "likeness/base/json.h"

#include <nlohmann/json.hpp>

#include "likeness/base/error.h"

namespace likeness {

using nlohmann::json;

json ParseJson(const std::filesystem::path& path_for_errors, std::string_view text) {
  constexpr int kMostDepth = 64;
  const json::parser_callback_t guard = [&](int depth, json::parse_event_t event, json&) {
    const bool opens = event == json::parse_event_t::object_start || event == json::parse_event_t::array_start;
    if (opens && depth >= kMostDepth) {
      throw FileError(path_for_errors, fmt::format("is nested more than {} deep", kMostDepth));
    }
    return true;
  };
  try {
    return json::parse(text, guard);
  } catch (const json::exception& error) {
    throw FileError(path_for_errors, fmt::format("is no JSON: {}", error.what()));
  }
}

}  // namespace likeness
