// The small files of Ava-256 and Goliath: calibration (JSON) and lists of frames (CSV).

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "likeness/geometry/camera.h"
#include "likeness/geometry/lens.h"

namespace likeness {

// A camera as camera_calibration.json gives it, for the sensor's whole image whatever size the pictures have.
struct SensorCamera {
  Camera camera;  // K of the whole sensor; width and height are 0
  Lens lens;      // radial-tangential, k1 k2 p1 p2

  // How far the lens moves the pixel that it moves furthest, of images that `scaled` is the camera of.
  double LargestShiftPx(const Camera& scaled) const;
};

// {"KRT": [{"cameraId", "K", "T", "distortion"}]}. K (3 x 3) and T (4 x 4) are stored transposed: [R | t] of the
// camera from the world, mm, are rows 0 to 2 of T^T. Throws Error, naming the camera, for matrices of another shape or
// not transposed, values that are not finite, an R that is no rotation, and names that are unusable or used twice.
std::vector<SensorCamera> ParseSensorCalibration(const std::filesystem::path& path_for_errors, std::string_view text);

// A CSV with a header line: the columns `first` and `second`, which may stand anywhere in it. Throws Error when one is
// missing or a line is too short.
std::vector<std::pair<std::string, std::string>> ParseCsvColumns(const std::filesystem::path& path_for_errors,
                                                                 std::string_view text, const std::string& first,
                                                                 const std::string& second);

// One row of a list of frames.
struct ListedFrame {
  std::string segment;
  int64_t number = 0;
  auto operator<=>(const ListedFrame&) const = default;
};

// Ava-256's frame_list.csv: columns seg_id and frame_id.
std::vector<ListedFrame> ParseFrameListCsv(const std::filesystem::path& path_for_errors, std::string_view text);

// Goliath's frame_splits_list.csv (columns frame and split) and frame_segments_list.csv (columns frame and
// segment_name; empty text where there is none, then all frames are of segment "all"). A frame of the split "test" gets
// the segment "test_<segment>", so that the split can be told by prefix.
std::vector<ListedFrame> ParseFrameSplitsCsv(const std::filesystem::path& splits_path, std::string_view splits_text,
                                             const std::filesystem::path& segments_path,
                                             std::string_view segments_text);
inline constexpr const char* kTestPrefix = "test_";

}  // namespace likeness
