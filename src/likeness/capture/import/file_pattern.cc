#include "likeness/capture/import/file_pattern.h"

#include <fmt/format.h>

#include <optional>
#include <vector>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/capture/layout.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

std::string* Part(PatternParts* parts, std::string_view word) {
  if (word == "segment") return &parts->segment;
  if (word == "camera") return &parts->camera;
  if (word == "frame") return &parts->frame;
  return nullptr;
}

// Matches one file or folder name with one component of the pattern; fills in parts that are still empty.
std::optional<PatternParts> Match(std::string_view pattern, std::string_view name, const PatternParts& known) {
  if (pattern.empty()) return name.empty() ? std::optional(known) : std::nullopt;
  if (pattern[0] != '{') {
    if (name.empty() || name[0] != pattern[0]) return std::nullopt;
    return Match(pattern.substr(1), name.substr(1), known);
  }
  const size_t end = pattern.find('}');
  PatternParts parts = known;
  std::string* part = Part(&parts, pattern.substr(1, end - 1));
  if (!part->empty()) {
    if (!name.starts_with(*part)) return std::nullopt;
    return Match(pattern.substr(end + 1), name.substr(part->size()), parts);
  }
  for (size_t length = 1; length <= name.size(); ++length) {
    *part = name.substr(0, length);
    if (auto matched = Match(pattern.substr(end + 1), name.substr(length), parts)) return matched;
  }
  return std::nullopt;
}

class Finder {
 public:
  explicit Finder(const std::string& pattern) : pattern_(pattern) {
    for (size_t at = pattern.find('{'); at != std::string::npos; at = pattern.find('{', at + 1)) {
      const size_t end = pattern.find('}', at);
      PatternParts parts;
      const std::string word = pattern.substr(at + 1, end == std::string::npos ? end : end - at - 1);
      if (end == std::string::npos || Part(&parts, word) == nullptr) {
        throw Error("pattern '{}': '{{{}}}' is not known; expected {{segment}}, {{camera}} or {{frame}}", pattern,
                    word);
      }
    }
    const fs::path path(pattern);
    for (const fs::path& component : path) components_.push_back(component.string());
  }

  std::map<PatternParts, fs::path> Find() {
    Walk("", 0, {});
    if (found_.empty())
      throw Error("pattern '{}': no file matches; is it in quotes, and is the folder right?", pattern_);
    return std::move(found_);
  }

 private:
  void Walk(const fs::path& folder, size_t index, const PatternParts& parts) {
    std::error_code ignored;
    if (index == components_.size()) {
      if (!fs::is_regular_file(folder, ignored)) return;
      for (const std::string* part : {&parts.segment, &parts.camera, &parts.frame}) {
        if (!part->empty() && !IsLayoutName(*part)) {
          throw FileError(folder, fmt::format("'{}' cannot be a name in a capture", *part));
        }
      }
      const auto [it, added] = found_.emplace(parts, folder);
      if (!added) throw FileError(folder, fmt::format("stands for the same as {}", it->second.string()));
      return;
    }
    const std::string& component = components_[index];
    if (component.find('{') == std::string::npos) {
      Walk(folder / component, index + 1, parts);
      return;
    }
    for (const std::string& name : ListFolder(folder.empty() ? "." : folder)) {
      if (name.starts_with('.') && !component.starts_with('.')) continue;
      if (const auto matched = Match(component, name, parts)) Walk(folder / name, index + 1, *matched);
    }
  }

  const std::string& pattern_;
  std::vector<std::string> components_;
  std::map<PatternParts, fs::path> found_;
};

}  // namespace

std::map<PatternParts, fs::path> FindFiles(const std::string& pattern) { return Finder(pattern).Find(); }

}  // namespace likeness
