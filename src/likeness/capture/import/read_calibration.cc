#include "likeness/capture/import/read_calibration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/text.h"
#include "likeness/capture/calibration_formats/colmap.h"
#include "likeness/capture/calibration_formats/nerfstudio.h"
#include "likeness/capture/calibration_formats/opencv_storage.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

bool IsFolder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

DistortedCameras ReadNerfstudio(const fs::path& source) {
  const fs::path path = IsFolder(source) ? source / "transforms.json" : source;
  DistortedCameras cameras = ParseNerfstudio(path, ReadFile(path));
  for (DistortedCamera& camera : cameras) {
    camera.image = path.parent_path() / camera.image;
    // Blender's data sets leave the ending out.
    if (!Exists(camera.image) && Exists(camera.image.string() + ".png")) camera.image += ".png";
    if (!camera.mask.empty()) camera.mask = path.parent_path() / camera.mask;
  }
  return cameras;
}

DistortedCameras ReadColmap(const fs::path& source) {
  fs::path folder;
  std::string ending;
  for (const fs::path& candidate : {source, source / "sparse" / "0", source / "sparse"}) {
    for (const char* e : {".bin", ".txt"}) {
      if (ending.empty() && Exists(candidate / (std::string("cameras") + e))) {
        folder = candidate;
        ending = e;
      }
    }
  }
  if (ending.empty()) {
    throw FileError(source, "holds no COLMAP model; expected cameras.bin and images.bin, or .txt, here or in sparse/0");
  }
  const std::string cameras_file = ReadFile(folder / ("cameras" + ending));
  const std::string images_file = ReadFile(folder / ("images" + ending));
  DistortedCameras cameras = ending == ".bin" ? ParseColmapBinary(folder, cameras_file, images_file)
                                              : ParseColmapText(folder, cameras_file, images_file);
  fs::path root = fs::absolute(folder).lexically_normal();
  if (!root.has_filename()) root = root.parent_path();
  for (int i = 0; i < 2 && !IsFolder(root / "images"); ++i) root = root.parent_path();
  for (DistortedCamera& camera : cameras) {
    const fs::path mask = root / "masks" / (camera.image.string() + ".png");
    if (Exists(mask)) camera.mask = mask;
    camera.image = root / "images" / camera.image;
  }
  return cameras;
}

DistortedCameras ReadOpenCv(const fs::path& source, bool fisheye) {
  std::vector<StorageFile> files;
  if (IsFolder(source)) {
    for (const std::string& name : ListFolder(source)) {
      const std::string ending = fs::path(name).extension().string();
      if (ending == ".yml" || ending == ".yaml" || ending == ".xml" || ending == ".json")
        files.push_back({source / name, {}});
    }
    if (files.empty()) throw FileError(source, "holds no calibration; expected .yml, .yaml, .xml or .json files");
  } else {
    files.push_back({source, {}});
  }
  for (StorageFile& file : files) file.root = ParseStorage(file.path, ReadFile(file.path, 1 << 26));
  return CamerasFromStorage(files, fisheye);
}

}  // namespace

const std::vector<std::string>& CalibrationKinds() {
  static const std::vector<std::string> kinds = {"nerfstudio", "colmap", "opencv"};
  return kinds;
}

DistortedCameras ReadCalibration(const std::string& kind, const fs::path& source, bool fisheye) {
  if (!Exists(source)) throw FileError(source, "no such file or folder");
  if (kind == "nerfstudio") return ReadNerfstudio(source);
  if (kind == "colmap") return ReadColmap(source);
  if (kind == "opencv") return ReadOpenCv(source, fisheye);
  const std::string nearest = NearestWord(kind, CalibrationKinds());
  throw Error("there is no kind '{}'{}; known are {}", kind,
              nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest), fmt::join(CalibrationKinds(), ", "));
}

}  // namespace likeness
