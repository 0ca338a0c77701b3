#include "likeness/capture/ava256/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/json.h"
#include "likeness/base/text.h"
#include "likeness/capture/layout.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kRotationTolerance = 1e-3;
constexpr double kFarthest_mm = 1e7;

// Parts of one camera's record, with errors that name file and camera.
class Record {
 public:
  Record(const fs::path& path, const json& object, size_t index)
      : path_(path), object_(object), who_(fmt::format("camera {} of the list", index)) {
    if (!object.is_object()) Fail("expected {\"cameraId\", \"K\", \"T\", \"distortion\"}");
  }

  std::string Name() {
    const json& id = Get("cameraId");
    std::string name = id.is_string()           ? id.get<std::string>()
                       : id.is_number_integer() ? std::to_string(id.get<int64_t>())
                                                : std::string();
    if (!IsLayoutName(name)) Fail("its cameraId cannot be a name");
    who_ = "camera " + name;
    return name;
  }

  Eigen::MatrixXd Matrix(const char* key, size_t size) const {
    const json& rows = Get(key);
    if (!rows.is_array() || rows.size() != size) Fail(fmt::format("\"{}\" must be {} x {} numbers", key, size, size));
    Eigen::MatrixXd matrix(size, size);
    for (size_t row = 0; row < size; ++row) {
      const std::vector<double> numbers = Numbers(rows[row], key, size);
      for (size_t column = 0; column < size; ++column) matrix(row, column) = numbers[column];
    }
    return matrix;
  }

  Lens ReadLens() const {
    if (!object_.contains("distortion") || Get("distortion") == json::array()) return {};
    const std::vector<double> numbers = Numbers(Get("distortion"), "distortion", 4);
    if (std::count(numbers.begin(), numbers.end(), 0.0) == 4) return {};
    return {Lens::Model::kRadialTangential, {numbers[0], numbers[1], numbers[2], numbers[3]}};
  }

  [[noreturn]] void Fail(const std::string& message) const {
    throw FileError(path_, fmt::format("{}: {}", who_, message));
  }

 private:
  const json& Get(const char* key) const {
    const auto it = object_.find(key);
    if (it == object_.end()) Fail(fmt::format("has no \"{}\"", key));
    return *it;
  }

  std::vector<double> Numbers(const json& list, const char* key, size_t count) const {
    if (!list.is_array() || list.size() != count) Fail(fmt::format("\"{}\" needs {} numbers a line", key, count));
    std::vector<double> numbers;
    for (const json& value : list) {
      if (!value.is_number() || !std::isfinite(value.get<double>())) {
        Fail(fmt::format("\"{}\" holds what is no finite number", key));
      }
      numbers.push_back(value.get<double>());
    }
    return numbers;
  }

  const fs::path& path_;
  const json& object_;
  std::string who_;
};

Eigen::Matrix3d Intrinsics(const Record& record) {
  const Eigen::Matrix3d stored = record.Matrix("K", 3);
  const Eigen::Matrix3d k = stored.transpose();
  if (k(1, 0) != 0 || k(2, 0) != 0 || k(2, 1) != 0 || k(2, 2) != 1) {
    record.Fail(stored(1, 0) == 0 && stored(2, 0) == 0 && stored(2, 1) == 0
                    ? "K is not stored transposed, as Ava-256 and Goliath do: its last row must be cx cy 1"
                    : "K must be lower triangular, as the transposed of a camera matrix is, with K[2][2] = 1");
  }
  if (k(0, 0) <= 0 || k(1, 1) <= 0 || k.cwiseAbs().maxCoeff() > 1e7) {
    record.Fail(fmt::format("focal lengths of {:g} and {:g} pixels", k(0, 0), k(1, 1)));
  }
  return k;
}

RigidTransform Extrinsics(const Record& record) {
  const Eigen::Matrix4d stored = record.Matrix("T", 4);
  if (stored.col(3) != Eigen::Vector4d(0, 0, 0, 1)) {
    record.Fail(stored.row(3) == Eigen::RowVector4d(0, 0, 0, 1)
                    ? "T is not stored transposed, as Ava-256 and Goliath do: its last row must be the translation"
                    : "the last column of T must be 0 0 0 1");
  }
  const RigidTransform transform = {stored.topLeftCorner<3, 3>().transpose(), stored.row(3).head<3>().transpose()};
  if (const double defect = RotationDefect(transform.rotation); !(defect <= kRotationTolerance)) {
    record.Fail(fmt::format("T is no rigid transform: its rotation {}",
                            std::isinf(defect) ? "mirrors" : fmt::format("is off by {:.3g}", defect)));
  }
  if (transform.translation.cwiseAbs().maxCoeff() > kFarthest_mm) {
    record.Fail(fmt::format("a translation of over {:g} mm; expected millimetres", kFarthest_mm));
  }
  return transform;
}

int64_t FrameNumber(const fs::path& path, const std::string& word) {
  // A list that went through a spreadsheet or pandas may say 123.0.
  std::string digits = word;
  if (digits.ends_with(".0")) digits.resize(digits.size() - 2);
  const bool whole = !digits.empty() && digits.size() < 16 &&
                     std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!whole) throw FileError(path, fmt::format("expected frame numbers, found '{}'", word.substr(0, 40)));
  return std::stoll(digits);
}

}  // namespace

double SensorCamera::LargestShiftPx(const Camera& scaled) const {
  double largest = 0;
  constexpr int kSteps = 16;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const Eigen::Vector2d pixel(static_cast<double>(i) / kSteps * scaled.width,
                                  static_cast<double>(j) / kSteps * scaled.height);
      const Eigen::Matrix3d& k = scaled.intrinsics;
      const Eigen::Vector2d ideal((pixel.x() - k(0, 2)) / k(0, 0), (pixel.y() - k(1, 2)) / k(1, 1));
      const Eigen::Vector2d moved = lens.Distort(ideal) - ideal;
      largest = std::max(largest, std::hypot(moved.x() * k(0, 0), moved.y() * k(1, 1)));
    }
  }
  return largest;
}

std::vector<SensorCamera> ParseSensorCalibration(const fs::path& path_for_errors, std::string_view text) {
  const json root = ParseJson(path_for_errors, text);
  const auto list = root.is_object() ? root.find("KRT") : root.end();
  if (!root.is_object() || list == root.end() || !list->is_array()) {
    throw FileError(path_for_errors, "expected {\"KRT\": [cameras]}");
  }
  std::vector<SensorCamera> cameras;
  std::set<std::string> names;
  for (size_t i = 0; i < list->size(); ++i) {
    Record record(path_for_errors, (*list)[i], i);
    SensorCamera sensor;
    sensor.camera.name = record.Name();
    if (!names.insert(sensor.camera.name).second) record.Fail("is described twice");
    sensor.camera.intrinsics = Intrinsics(record);
    sensor.camera.cam_from_world = Extrinsics(record);
    sensor.lens = record.ReadLens();
    cameras.push_back(std::move(sensor));
  }
  if (cameras.empty()) throw FileError(path_for_errors, "describes no cameras");
  return cameras;
}

std::vector<std::pair<std::string, std::string>> ParseCsvColumns(const fs::path& path_for_errors, std::string_view text,
                                                                 const std::string& first, const std::string& second) {
  TextLines lines(path_for_errors, text);
  if (!lines.Next()) throw FileError(path_for_errors, "is empty");
  const auto header = lines.Fields(',');
  const auto column = [&](const std::string& name) {
    const auto it = std::find(header.begin(), header.end(), name);
    if (it == header.end()) lines.Fail(fmt::format("expected a column '{}' in the first line", name));
    return static_cast<size_t>(it - header.begin());
  };
  const size_t a = column(first), b = column(second);
  std::vector<std::pair<std::string, std::string>> rows;
  while (lines.Next()) {
    if (Trim(lines.line()).empty()) continue;
    const auto fields = lines.Fields(',');
    if (fields.size() <= std::max(a, b)) lines.Fail(fmt::format("expected {} values", header.size()));
    rows.emplace_back(fields[a], fields[b]);
  }
  return rows;
}

std::vector<ListedFrame> ParseFrameListCsv(const fs::path& path_for_errors, std::string_view text) {
  std::vector<ListedFrame> frames;
  for (const auto& [segment, frame] : ParseCsvColumns(path_for_errors, text, "seg_id", "frame_id")) {
    if (!IsLayoutName(segment)) {
      throw FileError(path_for_errors, fmt::format("a segment cannot have the name '{}'", segment.substr(0, 40)));
    }
    frames.push_back({segment, FrameNumber(path_for_errors, frame)});
  }
  if (frames.empty()) throw FileError(path_for_errors, "lists no frames");
  return frames;
}

std::vector<ListedFrame> ParseFrameSplitsCsv(const fs::path& splits_path, std::string_view splits_text,
                                             const fs::path& segments_path, std::string_view segments_text) {
  std::map<int64_t, std::string> segment_of;
  if (!segments_text.empty()) {
    for (const auto& [frame, segment] : ParseCsvColumns(segments_path, segments_text, "frame", "segment_name")) {
      if (!IsLayoutName(segment) || segment.starts_with(kTestPrefix)) {
        throw FileError(segments_path, fmt::format("a segment cannot have the name '{}'", segment.substr(0, 40)));
      }
      segment_of[FrameNumber(segments_path, frame)] = segment;
    }
  }
  std::vector<ListedFrame> frames;
  for (const auto& [frame, split] : ParseCsvColumns(splits_path, splits_text, "frame", "split")) {
    const int64_t number = FrameNumber(splits_path, frame);
    const auto it = segment_of.find(number);
    const std::string segment = it == segment_of.end() ? "all" : it->second;
    frames.push_back({(split == "test" ? kTestPrefix : "") + segment, number});
  }
  if (frames.empty()) throw FileError(splits_path, "lists no frames");
  return frames;
}

}  // namespace likeness
