#include <fmt/format.h>

#include <iterator>
#include <map>

#include "likeness/base/error.h"
#include "likeness/base/text.h"
#include "likeness/capture/calibration_formats/colmap_internal.h"

namespace likeness {
namespace {

bool IsComment(const TextLines& lines) {
  const std::string_view line = Trim(lines.line());
  return line.empty() || line.front() == '#';
}

uint32_t Id(const TextLines& lines, std::string_view word) {
  const int64_t id = lines.Integer(word);
  if (id < 0 || id > UINT32_MAX) lines.Fail(fmt::format("{} is no identifier", id));
  return static_cast<uint32_t>(id);
}

// CAMERA_ID MODEL WIDTH HEIGHT PARAMS...
std::map<uint32_t, DistortedCamera> ParseCameras(const std::filesystem::path& path, std::string_view text) {
  std::map<uint32_t, DistortedCamera> cameras;
  TextLines lines(path, text);
  while (lines.Next()) {
    if (IsComment(lines)) continue;
    const auto words = lines.Words();
    if (words.size() < 4) lines.Fail("expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS");
    const colmap::Model& model = colmap::FindModel(path, words[1]);
    if (words.size() != 4 + model.parameters) {
      lines.Fail(fmt::format("{} has {} parameters, found {}", model.name, model.parameters, words.size() - 4));
    }
    std::vector<double> parameters;
    for (size_t i = 4; i < words.size(); ++i) parameters.push_back(lines.Number(words[i]));
    const uint32_t id = Id(lines, words[0]);
    const int64_t width = lines.Integer(words[2]), height = lines.Integer(words[3]);
    const DistortedCamera camera =
        colmap::MakeCamera(path, model, static_cast<uint64_t>(width), static_cast<uint64_t>(height), parameters);
    if (!cameras.emplace(id, camera).second) lines.Fail(fmt::format("camera {} is described twice", id));
  }
  return cameras;
}

// The name is the rest of the line: it may hold blanks.
std::string_view AfterWords(std::string_view line, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    line = Trim(line);
    line.remove_prefix(std::min(line.size(), line.find_first_of(" \t")));
  }
  return Trim(line);
}

}  // namespace

DistortedCameras ParseColmapText(const std::filesystem::path& folder, std::string_view cameras_text,
                                 std::string_view images_text) {
  const std::map<uint32_t, DistortedCamera> cameras = ParseCameras(folder / "cameras.txt", cameras_text);
  const std::filesystem::path path = folder / "images.txt";
  DistortedCameras images;
  TextLines lines(path, images_text);
  while (lines.Next()) {
    if (IsComment(lines)) continue;
    const auto words = lines.Words();
    if (words.size() < 10) lines.Fail("expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME");
    std::array<double, 7> pose;
    for (size_t i = 0; i < pose.size(); ++i) pose[i] = lines.Number(words[i + 1]);
    images.push_back(colmap::MakeImage(path, cameras, Id(lines, words[8]), pose, AfterWords(lines.line(), 9)));
    lines.Next();  // the image's 2D points: a line of their own, perhaps empty
  }
  NameByImages(path, &images);
  CheckCameras(path, images);
  return images;
}

ColmapFiles FormatColmapText(const DistortedCameras& cameras, const std::vector<ColouredPoint>& points) {
  ColmapFiles files;
  files.cameras = "# CAMERA_ID MODEL WIDTH HEIGHT fx fy cx cy\n";
  files.images = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of 2D points (here empty)\n";
  files.points = "# POINT3D_ID X Y Z R G B ERROR TRACK\n";
  for (size_t i = 0; i < cameras.size(); ++i) {
    const DistortedCamera& source = cameras[i];
    const auto p = colmap::PinholeParameters(source);
    const auto q = colmap::Pose(source);
    fmt::format_to(std::back_inserter(files.cameras), "{} PINHOLE {} {} {} {} {} {}\n", i + 1, source.camera.width,
                   source.camera.height, p[0], p[1], p[2], p[3]);
    fmt::format_to(std::back_inserter(files.images), "{} {} {} {} {} {} {} {} {} {}\n\n", i + 1, q[0], q[1], q[2], q[3],
                   q[4], q[5], q[6], i + 1, source.image.generic_string());
  }
  for (size_t i = 0; i < points.size(); ++i) {
    const auto& [position, rgb] = points[i];
    fmt::format_to(std::back_inserter(files.points), "{} {} {} {} {} {} {} 0\n", i + 1, position.x(), position.y(),
                   position.z(), rgb[0], rgb[1], rgb[2]);
  }
  return files;
}

}  // namespace likeness
