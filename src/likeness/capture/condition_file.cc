#include "likeness/capture/condition_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/text.h"
#include "likeness/capture/layout.h"

namespace likeness {

namespace {

constexpr uint64_t kMostBytes = uint64_t{1} << 30;
constexpr size_t kMostColumns = 1024;

}  // namespace

ConditionTable ParseConditionTable(const std::filesystem::path& path_for_errors, std::string_view text) {
  TextLines lines(path_for_errors, text);
  ConditionTable table;
  bool header = true;
  while (lines.Next()) {
    if (Trim(lines.line()).empty()) continue;
    const std::vector<std::string_view> fields = lines.Fields(',');
    if (header) {
      if (fields.size() < 3 || Trim(fields[0]) != "segment" || Trim(fields[1]) != "frame") {
        lines.Fail("expected a header: segment,frame, and a name for each value");
      }
      if (fields.size() > kMostColumns + 2) lines.Fail(fmt::format("has more than {} values", kMostColumns));
      for (size_t i = 2; i < fields.size(); ++i) {
        table.columns.emplace_back(Trim(fields[i]));
        if (!IsLayoutName(table.columns.back())) lines.Fail(fmt::format("value {} needs a name, one word", i - 1));
      }
      header = false;
      continue;
    }
    if (fields.size() != table.columns.size() + 2) {
      lines.Fail(fmt::format("has {} fields, its header {}", fields.size(), table.columns.size() + 2));
    }
    const FrameId frame = {std::string(Trim(fields[0])), std::string(Trim(fields[1]))};
    if (!IsLayoutName(frame.segment) || !IsLayoutName(frame.frame)) lines.Fail("no frame can have this name");
    std::vector<float> values;
    for (size_t i = 2; i < fields.size(); ++i) values.push_back(lines.Float(Trim(fields[i])));
    if (!table.frames.emplace(frame, std::move(values)).second) {
      lines.Fail(fmt::format("frame {} {} has a line already", frame.segment, frame.frame));
    }
  }
  if (header) throw FileError(path_for_errors, "is empty; expected a header: segment,frame, and a name for each value");
  return table;
}

std::string ConditionTableText(const ConditionTable& table) {
  std::string text = fmt::format("segment,frame,{}\n", fmt::join(table.columns, ","));
  for (const auto& [frame, values] : table.frames) {
    text += fmt::format("{},{},{}\n", frame.segment, frame.frame, fmt::join(values, ","));
  }
  return text;
}

ConditionFile::ConditionFile(const std::filesystem::path& capture_root, const std::string& name)
    : path_(CaptureLayout(capture_root).Condition(name)) {
  if (!std::filesystem::exists(path_)) {
    throw FileError(path_, fmt::format("is absent; the condition '{}' needs it (docs/your-own-capture.md)", name));
  }
  table_ = ParseConditionTable(path_, ReadFile(path_, kMostBytes));
}

const std::vector<float>& ConditionFile::Of(const FrameId& frame) const {
  const auto found = table_.frames.find(frame);
  if (found == table_.frames.end()) {
    throw FileError(path_, fmt::format("has no line for frame {} {}", frame.segment, frame.frame));
  }
  return found->second;
}

}  // namespace likeness
