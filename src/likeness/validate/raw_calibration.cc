#include "likeness/validate/raw_calibration.h"

#include <fmt/format.h>

#include "likeness/base/error.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

template <int kRows, int kColumns>
Eigen::Matrix<double, kRows, kColumns> ReadRows(TextLines* lines, const char* what) {
  Eigen::Matrix<double, kRows, kColumns> matrix;
  for (int row = 0; row < kRows; ++row) {
    if (!lines->Next()) lines->Fail(fmt::format("the file ends here; expected {}", what));
    const std::vector<double> numbers = lines->Numbers(kColumns);
    for (int column = 0; column < kColumns; ++column) matrix(row, column) = numbers[static_cast<size_t>(column)];
  }
  return matrix;
}

}  // namespace

RawCalibration ParseRawCalibration(const std::filesystem::path& path_for_errors, std::string_view text) {
  RawCalibration calibration;
  TextLines lines(path_for_errors, text);
  try {
    while (lines.Next()) {
      const auto words = lines.Words();
      if (words.empty()) continue;
      if (words.size() != 1 && words.size() != 3) lines.Fail("expected a camera's name, or its name, width and height");
      RawCamera camera;
      camera.name = words[0];
      camera.line = lines.number();
      if (words.size() == 3) {
        camera.width = lines.Integer(words[1]);
        camera.height = lines.Integer(words[2]);
      }
      camera.intrinsics = ReadRows<3, 3>(&lines, "a line of K");
      const Eigen::Matrix<double, 1, 5> distortion = ReadRows<1, 5>(&lines, "five distortion values");
      for (int i = 0; i < 5; ++i) camera.distortion[static_cast<size_t>(i)] = distortion(0, i);
      camera.cam_from_world = ReadRows<3, 4>(&lines, "a line of [R | t]");
      calibration.cameras.push_back(std::move(camera));
    }
  } catch (const Error& error) {
    calibration.problem = error.what();
  }
  return calibration;
}

Eigen::Matrix<double, 3, 4> ParseRawTransform(const std::filesystem::path& path_for_errors, std::string_view text) {
  TextLines lines(path_for_errors, text);
  const Eigen::Matrix<double, 3, 4> transform = ReadRows<3, 4>(&lines, "three lines of four numbers");
  while (lines.Next()) {
    if (lines.Words().empty()) continue;
    if (lines.Numbers(4) != std::vector<double>{0, 0, 0, 1}) lines.Fail("expected three lines of four numbers");
  }
  return transform;
}

}  // namespace likeness
