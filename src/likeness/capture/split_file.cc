#include "likeness/capture/split_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/json.h"
#include "likeness/base/log.h"
#include "likeness/capture/layout.h"

namespace likeness {
namespace {

using nlohmann::json;

std::vector<std::string> Names(const std::filesystem::path& path, const json& parent, const char* key) {
  const auto list = parent.find(key);
  if (list == parent.end() || !list->is_array()) throw FileError(path, fmt::format("expected \"{}\": [names]", key));
  std::vector<std::string> names;
  for (const json& name : *list) {
    if (!name.is_string() || !IsLayoutName(name.get_ref<const std::string&>())) {
      throw FileError(path, fmt::format("\"{}\" must be a list of names in quotes", key));
    }
    names.push_back(name);
  }
  return names;
}

bool Contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

SplitNames ParseSplit(const std::filesystem::path& path_for_errors, std::string_view text) {
  const json root = ParseJson(path_for_errors, text);
  if (!root.is_object()) throw FileError(path_for_errors, "expected a JSON object");
  SplitNames names;
  if (const auto full = root.find("full"); full != root.end()) {
    names.has_cameras = true;
    names.train = Names(path_for_errors, *full, "train");
    names.test = Names(path_for_errors, *full, "test");
  }
  if (root.contains("segment")) {
    names.has_segments = true;
    names.segments = Names(path_for_errors, root, "segment");
  }
  if (!names.has_cameras && !names.has_segments) {
    throw FileError(path_for_errors,
                    R"(is no split: expected {"full": {"train": [...], "test": [...]}}, {"segment": [...]}, or both)");
  }
  return names;
}

Split ResolveSplit(const std::filesystem::path& path_for_errors, const SplitNames& names,
                   const std::vector<Camera>& cameras) {
  Split split;
  split.held_out_segments = names.segments;
  std::vector<std::string> known;
  for (const Camera& camera : cameras) {
    known.push_back(camera.name);
    if (!names.has_cameras || Contains(names.train, camera.name)) {
      split.training_cameras.push_back(camera.name);
    } else if (Contains(names.test, camera.name)) {
      split.held_out_cameras.push_back(camera.name);
    }
  }
  std::vector<std::string> unknown;
  for (const auto* list : {&names.train, &names.test}) {
    for (const std::string& name : *list) {
      if (!Contains(known, name) && !Contains(unknown, name)) unknown.push_back(name);
    }
  }
  if (split.training_cameras.empty()) {
    throw FileError(path_for_errors, fmt::format("none of its {} training cameras is in the capture, whose cameras are "
                                                 "{}",
                                                 names.train.size(), fmt::join(known, ", ")));
  }
  if (!unknown.empty()) {
    LogWarning("{}: {} of its cameras are not in the capture: {}", path_for_errors.string(), unknown.size(),
               fmt::join(unknown, ", "));
  }
  return split;
}

Split FindSplit(const std::filesystem::path& default_file, const CaptureOptions& options,
                const std::vector<Camera>& cameras) {
  std::error_code ignored;
  std::filesystem::path path = options.split_file;
  if (path.empty() && std::filesystem::exists(default_file, ignored)) path = default_file;
  SplitNames names;
  if (!path.empty()) names = ParseSplit(path, ReadFile(path));
  if (const std::filesystem::path& test_segments = options.test_segments_file; !test_segments.empty()) {
    const SplitNames segments = ParseSplit(test_segments, ReadFile(test_segments));
    if (!segments.has_segments) throw FileError(test_segments, "expected \"segment\": [prefixes of test segments]");
    names.segments = segments.segments;
  }
  return ResolveSplit(path, names, cameras);
}

std::string SplitText(const Split& split) {
  const auto& test = split.held_out_cameras.empty() ? split.training_cameras : split.held_out_cameras;
  const nlohmann::ordered_json root = {{"full", {{"train", split.training_cameras}, {"test", test}, {"visual", test}}},
                                       {"segment", split.held_out_segments}};
  return root.dump(2) + '\n';
}

}  // namespace likeness
