#include "likeness/capture/coefficient_table.h"

#include <algorithm>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/text.h"
#include "likeness/capture/layout.h"

namespace likeness {
namespace {

size_t FindColumn(const TextLines& lines, const std::vector<std::string_view>& header, std::string_view name) {
  const auto is_it = [&](std::string_view field) { return Trim(field) == name; };
  const auto found = std::find_if(header.begin(), header.end(), is_it);
  if (found == header.end()) lines.Fail(fmt::format("column {} is missing", name));
  if (std::any_of(found + 1, header.end(), is_it)) lines.Fail(fmt::format("column {} stands there twice", name));
  return static_cast<size_t>(found - header.begin());
}

}  // namespace

std::map<FrameId, std::vector<float>> ParseCoefficientTable(const std::filesystem::path& path_for_errors,
                                                            std::string_view text, std::span<const std::string> names) {
  TextLines lines(path_for_errors, text);
  if (!lines.Next()) {
    throw FileError(path_for_errors, "the file is empty, expected a header segment,frame,... and rows");
  }
  const std::vector<std::string_view> header = lines.Fields(',');
  const size_t segment = FindColumn(lines, header, "segment"), frame = FindColumn(lines, header, "frame");
  std::vector<size_t> columns;
  for (const std::string& name : names) columns.push_back(FindColumn(lines, header, name));
  std::map<FrameId, std::vector<float>> table;
  while (lines.Next()) {
    if (Trim(lines.line()).empty()) continue;
    const std::vector<std::string_view> fields = lines.Fields(',');
    if (fields.size() != header.size()) {
      lines.Fail(fmt::format("expected {} fields, found {}", header.size(), fields.size()));
    }
    std::vector<float> values;
    for (size_t i = 0; i < columns.size(); ++i) {
      const float value = lines.Float(Trim(fields[columns[i]]));
      if (value < 0 || value > 1) lines.Fail(fmt::format("{} is {}, expected 0 to 1", names[i], value));
      values.push_back(value);
    }
    const FrameId id{std::string(Trim(fields[segment])), std::string(Trim(fields[frame]))};
    if (!table.emplace(id, values).second) {
      lines.Fail(fmt::format("frame {} {} stands there twice", id.segment, id.frame));
    }
  }
  return table;
}

std::map<FrameId, std::vector<float>> ReadCoefficientTable(const std::filesystem::path& path,
                                                           std::span<const std::string> names) {
  return ParseCoefficientTable(path, ReadFile(path, uint64_t{1} << 28), names);
}

std::filesystem::path TrueCoefficients(const std::filesystem::path& capture_root) {
  return CaptureLayout(capture_root).Truth() / "performance.csv";
}

}  // namespace likeness
