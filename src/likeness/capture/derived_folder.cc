#include "likeness/capture/derived_folder.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/json.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

bool Contains(const fs::path& outer, const fs::path& inner) {
  return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

}  // namespace

fs::path AbsolutePath(const fs::path& path) {
  std::error_code code;
  fs::path absolute = fs::weakly_canonical(path, code);
  if (code) absolute = fs::absolute(path).lexically_normal();
  return absolute.has_filename() ? absolute : absolute.parent_path();
}

void CheckApart(const fs::path& source, const fs::path& out) {
  const fs::path from = AbsolutePath(source), to = AbsolutePath(out);
  if (Contains(from, to) || Contains(to, from)) {
    throw Error("{} and {} lie in each other; name a folder outside of the source", from.string(), to.string());
  }
}

void ClaimFolder(const fs::path& out, const std::string& record_name, const std::string& made,
                 const nlohmann::ordered_json& record) {
  const fs::path path = out / record_name;
  if (!Exists(path)) {
    if (!ListFolder(out).empty()) {
      throw FileError(out, fmt::format("holds something that was not {}; name a new or empty folder", made));
    }
    WriteFile(path, record.dump(2) + '\n');
    return;
  }
  const nlohmann::json before = ParseJson(path, ReadFile(path, 1 << 24));
  if (!before.is_object()) throw FileError(path, "is damaged; remove the folder or name another");
  std::vector<std::string> differences;
  for (const auto& [key, value] : record.items()) {
    const auto found = before.find(key);
    if (found == before.end() || found->dump() != value.dump()) differences.push_back(key);
  }
  if (!differences.empty()) {
    throw Error("{}: the capture there was {} otherwise (other {}); remove it or name another folder", out.string(),
                made, fmt::join(differences, ", "));
  }
}

}  // namespace likeness
