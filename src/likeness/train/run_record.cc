#include "likeness/train/run_record.h"

#include <fmt/format.h>

#include <array>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

constexpr uint64_t kMostBytes = 1 << 28;

}  // namespace

LossLog ReadLossLog(const std::filesystem::path& path) { return ParseLossLog(path, ReadFile(path, kMostBytes)); }

LossLog ParseLossLog(const std::filesystem::path& path_for_errors, std::string_view text) {
  TextLines lines(path_for_errors, text);
  if (!lines.Next()) throw FileError(path_for_errors, "is empty; expected a header with the names of columns");
  const std::vector<std::string_view> header = lines.Fields(',');
  LossLog log;
  const std::array<std::pair<const char*, std::vector<double>*>, 7> wanted = {{{"iteration", &log.iteration},
                                                                               {"elapsed_s", &log.elapsed_s},
                                                                               {"loss", &log.loss},
                                                                               {"texture", &log.texture},
                                                                               {"geometry", &log.geometry},
                                                                               {"kl", &log.kl},
                                                                               {"image", &log.image}}};
  std::vector<std::vector<double>*> columns(header.size(), nullptr);
  for (const auto& [name, values] : wanted) {
    bool found = false;
    for (size_t i = 0; i < header.size() && !found; ++i) {
      if (Trim(header[i]) == name) columns[i] = values, found = true;
    }
    if (!found && values != &log.image) lines.Fail(fmt::format("there is no column '{}'", name));
  }
  while (lines.Next()) {
    if (Trim(lines.line()).empty()) continue;
    const std::vector<std::string_view> fields = lines.Fields(',');
    if (fields.size() != columns.size()) {
      lines.Fail(fmt::format("{} values; expected {}, as in the header", fields.size(), columns.size()));
    }
    for (size_t i = 0; i < fields.size(); ++i) {
      if (columns[i] != nullptr) columns[i]->push_back(lines.Number(Trim(fields[i])));
    }
  }
  log.image.resize(log.iteration.size());
  return log;
}

std::vector<StageTime> ReadStageTimes(const std::filesystem::path& path) {
  return ParseStageTimes(path, ReadFile(path, kMostBytes));
}

std::vector<StageTime> ParseStageTimes(const std::filesystem::path& path_for_errors, std::string_view text) {
  TextLines lines(path_for_errors, text);
  std::vector<StageTime> stages;
  while (lines.Next()) {
    if (Trim(lines.line()).empty() || (lines.number() == 1 && Trim(lines.line()) == "stage,seconds")) continue;
    const std::vector<std::string_view> fields = lines.Fields(',');
    if (fields.size() != 2 || Trim(fields[0]).empty()) lines.Fail("expected: stage,seconds");
    const double seconds = lines.Number(Trim(fields[1]));
    if (seconds < 0) lines.Fail(fmt::format("a stage took {} seconds", seconds));
    stages.push_back({std::string(Trim(fields[0])), seconds});
  }
  return stages;
}

}  // namespace likeness
