// JSON that other people's files hold.

#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string_view>

namespace likeness {

// Parses a whole text. Throws Error naming the file when it is no JSON or is nested more than 64 deep: printing,
// comparing and copying call themselves once a level, and a file must not choose how deep our stack gets.
nlohmann::json ParseJson(const std::filesystem::path& path_for_errors, std::string_view text);

}  // namespace likeness
