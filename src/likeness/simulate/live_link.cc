#include "likeness/simulate/live_link.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "likeness/base/file.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

constexpr size_t kTimecode = 0, kCount = 1, kFirstChannel = 2;

// Which field of a row holds what.
struct Columns {
  size_t count = 0;
  std::array<size_t, kExpressionCount> expressions = {};
  std::optional<size_t> yaw, pitch, roll;
};

bool SameLetters(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

Columns ReadHeader(const TextLines& lines) {
  const std::vector<std::string_view> fields = lines.Fields(',');
  const auto find = [&](std::string_view name) {
    std::optional<size_t> found;
    for (size_t i = 0; i < fields.size(); ++i) {
      if (!SameLetters(Trim(fields[i]), name)) continue;
      if (found) lines.Fail(fmt::format("column {} stands there twice", name));
      found = i;
    }
    return found;
  };
  if (find("Timecode") != kTimecode || find("BlendShapeCount") != kCount) {
    lines.Fail("expected a header that begins with Timecode,BlendShapeCount, as Live Link Face writes");
  }
  Columns columns;
  columns.count = fields.size();
  for (size_t i = 0; i < kExpressionCount; ++i) {
    const auto column = find(ExpressionNames()[i]);
    if (!column) lines.Fail(fmt::format("column {} is missing", ExpressionNames()[i]));
    columns.expressions[i] = *column;
  }
  columns.yaw = find("HeadYaw");
  columns.pitch = find("HeadPitch");
  columns.roll = find("HeadRoll");
  return columns;
}

// HH:MM:SS:FF[.fraction]
struct Timecode {
  double seconds = 0;  // without FF
  double frame = 0;    // FF.fraction
};

Timecode ReadTimecode(const TextLines& lines, std::string_view text) {
  std::array<std::string_view, 4> parts;
  std::string_view rest = Trim(text);
  for (size_t i = 0; i < parts.size(); ++i) {
    const size_t colon = i + 1 < parts.size() ? rest.find(':') : rest.size();
    if (colon == std::string_view::npos) lines.Fail(fmt::format("'{}' is no timecode HH:MM:SS:FF", text));
    parts[i] = rest.substr(0, colon);
    rest = i + 1 < parts.size() ? rest.substr(colon + 1) : "";
  }
  const int64_t hours = lines.Integer(parts[0]), minutes = lines.Integer(parts[1]), seconds = lines.Integer(parts[2]);
  const double frame = lines.Number(parts[3]);
  if (hours < 0 || hours > 23 || minutes < 0 || minutes > 59 || seconds < 0 || seconds > 59 || frame < 0 ||
      frame >= 240) {
    lines.Fail(fmt::format("'{}' is no timecode HH:MM:SS:FF", text));
  }
  return {static_cast<double>(hours * 3600 + minutes * 60 + seconds), frame};
}

}  // namespace

LiveLinkRecording ParseLiveLink(const std::filesystem::path& path_for_errors, std::string_view text) {
  TextLines lines(path_for_errors, text);
  if (!lines.Next()) throw FileError(path_for_errors, "the file is empty, expected a Live Link Face recording");
  const Columns columns = ReadHeader(lines);
  LiveLinkRecording recording;
  std::vector<Timecode> timecodes;
  std::vector<int> line_numbers;
  for (int row = 0; lines.Next(); ++row) {
    if (Trim(lines.line()).empty()) continue;
    const std::vector<std::string_view> fields = lines.Fields(',');
    if (fields.size() < kFirstChannel) lines.Fail(fmt::format("expected {} fields", columns.count));
    const Timecode timecode = ReadTimecode(lines, fields[kTimecode]);
    const int64_t channels = lines.Integer(Trim(fields[kCount]));
    if (channels == 0) continue;
    if (fields.size() != columns.count) {
      lines.Fail(fmt::format("expected {} fields, found {}", columns.count, fields.size()));
    }
    if (channels != static_cast<int64_t>(columns.count - kFirstChannel)) {
      lines.Fail(
          fmt::format("BlendShapeCount is {}, but there are {} channels", channels, columns.count - kFirstChannel));
    }
    PerformanceFrame frame;
    frame.number = row;
    for (size_t i = 0; i < kExpressionCount; ++i) {
      const double weight = lines.Number(Trim(fields[columns.expressions[i]]));
      if (weight < -0.05 || weight > 1.05) {
        lines.Fail(fmt::format("{} is {}, expected 0 to 1", ExpressionNames()[i], weight));
      }
      frame.weights[i] = static_cast<float>(std::clamp(weight, 0.0, 1.0));
    }
    const auto angle = [&](std::optional<size_t> column) {
      if (!column) return 0.0;
      const double radians = lines.Number(Trim(fields[*column]));
      if (std::abs(radians) > std::numbers::pi) {
        lines.Fail(fmt::format("a head angle is {}, expected radians within half a turn", radians));
      }
      return radians;
    };
    frame.yaw = angle(columns.yaw);
    frame.pitch = angle(columns.pitch);
    frame.roll = angle(columns.roll);
    recording.frames.push_back(frame);
    timecodes.push_back(timecode);
    line_numbers.push_back(lines.number());
  }
  if (recording.frames.size() < 2) {
    throw FileError(path_for_errors, "fewer than two rows with a face, expected a recording");
  }
  double rate = 240;
  for (const double usual : {120.0, 60.0, 50.0, 48.0, 30.0, 25.0, 24.0}) {
    if (std::all_of(timecodes.begin(), timecodes.end(), [&](const Timecode& t) { return t.frame < usual; })) {
      rate = usual;
    }
  }
  constexpr double kDay = 24 * 3600;
  double previous = 0, days = 0, start = 0;
  for (size_t i = 0; i < timecodes.size(); ++i) {
    double time = timecodes[i].seconds + timecodes[i].frame / rate + days;
    if (i == 0) start = time;
    if (i > 0 && time < previous - kDay / 2) {  // past midnight
      days += kDay;
      time += kDay;
    }
    if (i > 0 && time < previous) throw FileError(path_for_errors, line_numbers[i], "time runs backwards");
    previous = time;
    recording.frames[i].time_s = time - start;
  }
  const double duration = recording.frames.back().time_s;
  if (duration <= 0) throw FileError(path_for_errors, "all rows have the same timecode");
  recording.frames_per_second = static_cast<double>(recording.frames.size() - 1) / duration;
  return recording;
}

LiveLinkRecording ReadLiveLink(const std::filesystem::path& path) {
  return ParseLiveLink(path, ReadFile(path, uint64_t{1} << 28));
}

SimulatedPerformance PerformanceFromRecording(const LiveLinkRecording& recording, int frames, uint64_t seed) {
  const auto available = static_cast<int64_t>(recording.frames.size());
  if (frames < 2) throw Error("a performance has 2 frames or more, not {}", frames);
  const int64_t count = std::min<int64_t>(frames, available);
  const bool still = std::all_of(recording.frames.begin(), recording.frames.end(),
                                 [](const PerformanceFrame& f) { return f.yaw == 0 && f.pitch == 0 && f.roll == 0; });
  const HeadMotion motion(seed);
  const int64_t segments = std::clamp<int64_t>(count / 4, 2, 15);
  SimulatedPerformance performance;
  for (int64_t s = 0; s < segments; ++s) {
    PerformanceSegment segment{fmt::format("REC_{:02}", s + 1), segments < 3 ? s == 1 : s % 5 == 2, {}};
    for (int64_t i = s * count / segments; i < (s + 1) * count / segments; ++i) {
      segment.frames.push_back(recording.frames[(2 * i + 1) * available / (2 * count)]);
      if (still) motion.Apply(&segment.frames.back());
    }
    performance.segments.push_back(std::move(segment));
  }
  return performance;
}

}  // namespace likeness
