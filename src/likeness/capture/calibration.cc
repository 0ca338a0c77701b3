#include "likeness/capture/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/text.h"
#include "likeness/capture/layout.h"

namespace likeness {
namespace {

// Published calibrations have seven digits; a matrix further from a rotation than this is something else.
constexpr double kRotationTolerance = 1e-3;
constexpr double kFarthest_mm = 1e7;  // ten kilometres
constexpr int64_t kLargestSide = 32768;

void NextLine(TextLines* lines, const char* expected) {
  if (!lines->Next()) lines->Fail(fmt::format("the file ends here; expected {}", expected));
}

// The next `rows` lines as a matrix.
Eigen::MatrixXd ReadRows(TextLines* lines, int rows, int columns, const char* what) {
  Eigen::MatrixXd matrix(rows, columns);
  for (int row = 0; row < rows; ++row) {
    NextLine(lines, what);
    const std::vector<double> numbers = lines->Numbers(static_cast<size_t>(columns));
    for (int column = 0; column < columns; ++column) matrix(row, column) = numbers[static_cast<size_t>(column)];
  }
  return matrix;
}

RigidTransform ReadRigid(TextLines* lines, const char* what) {
  const Eigen::MatrixXd rows = ReadRows(lines, 3, 4, what);
  const RigidTransform transform = {rows.leftCols<3>(), rows.col(3)};
  // Written so that it also fails when the defect overflowed to something that is not a number.
  if (const double defect = RotationDefect(transform.rotation); !(defect <= kRotationTolerance)) {
    lines->Fail(fmt::format("the three lines up to here are no rigid transform [R | t]: R {}",
                            defect == std::numeric_limits<double>::infinity()
                                ? "mirrors"
                                : fmt::format("differs from a rotation by {:.3g}", defect)));
  }
  if (transform.translation.cwiseAbs().maxCoeff() > kFarthest_mm) {
    lines->Fail(fmt::format("a translation of over {:g} mm; expected millimetres", kFarthest_mm));
  }
  return transform;
}

Eigen::Matrix3d ReadIntrinsics(TextLines* lines) {
  const Eigen::Matrix3d k = ReadRows(lines, 3, 3, "a line of K");
  if (k(1, 0) != 0 || k(2, 0) != 0 || k(2, 1) != 0 || k(2, 2) != 1) {
    lines->Fail(k(0, 2) == 0 && k(1, 2) == 0 && k(2, 0) != 0 ? "K is transposed: its last row must be 0 0 1"
                                                             : "K must be upper triangular with last row 0 0 1");
  }
  if (k(0, 0) <= 0 || k(1, 1) <= 0 || k.cwiseAbs().maxCoeff() > 1e7) {
    lines->Fail(fmt::format("focal lengths of {:g} and {:g} pixels", k(0, 0), k(1, 1)));
  }
  return k;
}

template <typename Matrix>
void AppendRows(std::string* text, const Matrix& matrix) {
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      fmt::format_to(std::back_inserter(*text), "{}{}", column > 0 ? " " : "", matrix(row, column));
    }
    *text += '\n';
  }
}

int Side(const TextLines& lines, std::string_view word) {
  const int64_t side = lines.Integer(word);
  if (side < 1 || side > kLargestSide) {
    lines.Fail(fmt::format("an image side of {} pixels; expected 1 to {}", side, kLargestSide));
  }
  return static_cast<int>(side);
}

}  // namespace

std::vector<Camera> ParseCalibration(const std::filesystem::path& path_for_errors, std::string_view text) {
  std::vector<Camera> cameras;
  std::set<std::string> names;
  TextLines lines(path_for_errors, text);
  while (lines.Next()) {
    const auto words = lines.Words();
    if (words.empty()) continue;
    if (words.size() != 1 && words.size() != 3) lines.Fail("expected a camera's name, or its name, width and height");
    Camera camera;
    camera.name = words[0];
    if (!IsLayoutName(camera.name)) lines.Fail("a camera cannot have this name");
    if (!names.insert(camera.name).second) lines.Fail(fmt::format("camera {} is described twice", camera.name));
    if (words.size() == 3) {
      camera.width = Side(lines, words[1]);
      camera.height = Side(lines, words[2]);
    }
    camera.intrinsics = ReadIntrinsics(&lines);
    NextLine(&lines, "five distortion values");
    const std::vector<double> distortion = lines.Numbers(5);
    if (std::any_of(distortion.begin(), distortion.end(), [](double d) { return d != 0; })) {
      lines.Fail(fmt::format("camera {} has lens distortion; undistort its images first and write five zeros here",
                             camera.name));
    }
    camera.cam_from_world = ReadRigid(&lines, "a line of [R | t]");
    cameras.push_back(std::move(camera));
  }
  if (cameras.empty()) throw FileError(path_for_errors, "describes no cameras");
  return cameras;
}

std::string CalibrationText(const std::vector<Camera>& cameras) {
  std::string text;
  for (const Camera& camera : cameras) {
    text += camera.name + '\n';
    AppendRows(&text, camera.intrinsics);
    text += "0 0 0 0 0\n" + TransformText(camera.cam_from_world) + '\n';
  }
  return text;
}

RigidTransform ParseTransform(const std::filesystem::path& path_for_errors, std::string_view text) {
  TextLines lines(path_for_errors, text);
  const RigidTransform transform = ReadRigid(&lines, "three lines of four numbers");
  while (lines.Next()) {
    if (!lines.Words().empty()) lines.Fail("expected three lines of four numbers and nothing more");
  }
  return transform;
}

std::string TransformText(const RigidTransform& transform) {
  Eigen::Matrix<double, 3, 4> matrix;
  matrix << transform.rotation, transform.translation;
  std::string text;
  AppendRows(&text, matrix);
  return text;
}

std::vector<FrameId> ParseFrameList(const std::filesystem::path& path_for_errors, std::string_view text) {
  std::vector<FrameId> frames;
  TextLines lines(path_for_errors, text);
  while (lines.Next()) {
    const auto words = lines.Words();
    if (words.empty()) continue;
    if (words.size() != 2) lines.Fail("expected a segment and a frame");
    if (!IsLayoutName(words[0]) || !IsLayoutName(words[1])) lines.Fail("a segment or frame cannot have this name");
    frames.push_back({std::string(words[0]), std::string(words[1])});
  }
  if (frames.empty()) throw FileError(path_for_errors, "lists no frames");
  return frames;
}

std::string FrameListText(const std::vector<FrameId>& frames) {
  std::string text;
  for (const FrameId& frame : frames) text += frame.segment + ' ' + frame.frame + '\n';
  return text;
}

}  // namespace likeness
