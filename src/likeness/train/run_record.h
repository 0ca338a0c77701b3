// What earlier stages wrote down about themselves, for the report: the loss as it fell, and the time that stages took.

#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace likeness {

// Columns of a training log (log.csv). All have as many values as `iteration`.
struct LossLog {
  std::vector<double> iteration;
  std::vector<double> elapsed_s;
  std::vector<double> loss;  // weighted sum of the terms below
  std::vector<double> texture;
  std::vector<double> geometry;
  std::vector<double> kl;
  std::vector<double> image;  // zeros without an image loss, or in logs that do not tell
};

// Reads the columns by name; others are left alone. Throws Error, with the line, for a header without one of the
// others, rows of another width, and values that are no finite numbers.
LossLog ReadLossLog(const std::filesystem::path& path);
LossLog ParseLossLog(const std::filesystem::path& path_for_errors, std::string_view text);

struct StageTime {
  std::string name;  // "simulate"
  double seconds = 0;
};

// Reads `stage,seconds` lines, with or without this header. Throws Error, with the line, for anything else.
std::vector<StageTime> ReadStageTimes(const std::filesystem::path& path);
std::vector<StageTime> ParseStageTimes(const std::filesystem::path& path_for_errors, std::string_view text);

}  // namespace likeness
