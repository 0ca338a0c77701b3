// Image files by name, header and bytes; nothing is decoded unless --all.

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/parallel.h"
#include "likeness/base/progress.h"
#include "likeness/base/random.h"
#include "likeness/capture/contact_sheet.h"
#include "likeness/image/image_io.h"
#include "likeness/validate/checks.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostHeaders = 4000;  // looked at unless --all

struct ImageFile {
  size_t frame = 0, camera = 0;
  fs::path path;
  uintmax_t bytes = 0;
  int width = 0, height = 0;  // 0 when unreadable
  std::string problem;
};

std::string NameOf(const Examination& e, const ImageFile& file) { return e.Relative(file.path); }

// Which images exist; tells of those that do not, and of folders and files that nothing asks for.
std::vector<ImageFile> ListImages(Examination* e) {
  std::set<std::string> segments, known;
  std::set<FrameId> listed;
  for (const ExaminedFrame& frame : e->frames) segments.insert(frame.id.segment), listed.insert(frame.id);
  for (const Camera& camera : e->cameras) known.insert(camera.name);
  std::map<std::pair<std::string, std::string>, std::set<std::string>> present;  // (segment, camera) -> file names
  std::set<std::string> uncalibrated;
  std::vector<std::string> unlisted;
  for (const std::string& segment : segments) {
    for (const std::string& camera : ListFolder(e->root / "images" / segment)) {
      if (camera.starts_with('.')) continue;
      if (!known.contains(camera)) {
        uncalibrated.insert(camera);
        continue;
      }
      auto& names = present[{segment, camera}];
      for (std::string& name : ListFolder(e->root / "images" / segment / camera)) {
        if (!name.ends_with(".png") || name.starts_with('.')) continue;
        if (!listed.contains({segment, name.substr(0, name.size() - 4)})) {
          unlisted.push_back(fmt::format("images/{}/{}/{}", segment, camera, name));
        }
        names.insert(std::move(name));
      }
    }
  }
  std::vector<ImageFile> files;
  std::vector<std::string> empty, absent;
  for (size_t c = 0; c < e->cameras.size(); ++c) {
    const size_t before = files.size();
    std::vector<std::string> missing;
    for (size_t f = 0; f < e->frames.size(); ++f) {
      const FrameId& id = e->frames[f].id;
      const fs::path path = e->layout.Image(id, e->cameras[c].name);
      const auto found = present.find({id.segment, e->cameras[c].name});
      if (found != present.end() && found->second.contains(path.filename().string())) {
        files.push_back({f, c, path, 0, 0, 0, ""});
      } else {
        missing.push_back(e->Relative(path));
      }
    }
    if (files.size() == before) {
      empty.push_back(e->cameras[c].name);
    } else {
      absent.insert(absent.end(), missing.begin(), missing.end());
    }
  }
  if (files.empty() && !e->frames.empty() && !e->cameras.empty()) {
    e->Found("images-missing", Severity::kMustFix, "images", "no camera has an image of any listed frame",
             "images belong to images/<segment>/<camera>/<frame>.png");
  } else if (!empty.empty()) {
    // Published captures come in parts; their calibration names all cameras.
    e->Found("camera-without-images", Severity::kNote, "images",
             fmt::format("{} cameras have no images: {}", empty.size(), SomeOf(empty)),
             "nothing, if these cameras are not on this disk on purpose");
  }
  if (!absent.empty()) {
    e->Found("image-absent", Severity::kWarning, absent.front(),
             fmt::format("{} images of listed frames are absent: {}", absent.size(), SomeOf(absent)),
             "copy them, or take the frames off frame_list.txt")
        .evidence = fmt::format("{} of {} images of these cameras", absent.size(), absent.size() + files.size());
  }
  if (!uncalibrated.empty() && !e->cameras.empty()) {
    const std::vector<std::string> names(uncalibrated.begin(), uncalibrated.end());
    e->Found("camera-not-calibrated", Severity::kWarning, "images",
             fmt::format("{} cameras have images but no calibration: {}", names.size(), SomeOf(names)),
             "add them to KRT, or rename the folders as KRT names the cameras");
  }
  if (!unlisted.empty()) {
    e->Found("image-not-listed", Severity::kWarning, unlisted.front(),
             fmt::format("{} images belong to no listed frame with a mesh: {}", unlisted.size(), SomeOf(unlisted)),
             "add the frames to frame_list.txt; nothing else reads them");
  }
  return files;
}

void ReadHeader(ImageFile* file, bool decode) {
  try {
    std::error_code failed;
    file->bytes = fs::file_size(file->path, failed);
    const ImageInfo info = ReadImageInfo(file->path);
    if (decode) {
      ReadImage(file->path);
    } else if (ReadFileStart(file->path, 4).substr(1) == "PNG" && !LooksWholePng(file->path)) {
      throw FileError(file->path, "the file ends too early");
    }
    file->width = info.width;
    file->height = info.height;
  } catch (const Error& error) {
    file->problem = error.what();
  }
}

// The size that most images of a camera have becomes the camera's.
void CheckSizes(Examination* e, const std::vector<ImageFile>& files) {
  std::vector<std::map<std::pair<int, int>, int>> votes(e->cameras.size());
  for (const ImageFile& file : files) {
    if (file.width > 0) ++votes[file.camera][{file.width, file.height}];
  }
  for (size_t c = 0; c < votes.size(); ++c) {
    if (votes[c].empty()) continue;
    const auto most =
        std::max_element(votes[c].begin(), votes[c].end(), [](auto& a, auto& b) { return a.second < b.second; });
    const auto [width, height] = most->first;
    Camera& camera = e->cameras[c];
    if (camera.width != 0 && (camera.width != width || camera.height != height)) {
      e->Found("calibration-size", Severity::kMustFix, "KRT, camera " + camera.name,
               "the calibration gives another image size than the images have",
               "write the images' own size, and K for that size")
          .evidence =
          fmt::format("KRT says {} x {}, the images are {} x {}", camera.width, camera.height, width, height);
    }
    camera.width = width;
    camera.height = height;
  }
  std::vector<std::string> odd;
  std::string evidence;
  for (const ImageFile& file : files) {
    const Camera& camera = e->cameras[file.camera];
    if (file.width == 0 || (file.width == camera.width && file.height == camera.height)) continue;
    if (odd.empty()) {
      evidence = fmt::format("{} x {}; most of camera {} are {} x {}", file.width, file.height, camera.name,
                             camera.width, camera.height);
    }
    odd.push_back(NameOf(*e, file));
  }
  if (odd.empty()) return;
  e->Found("image-size", Severity::kMustFix, odd.front(),
           fmt::format("{} images have another size than their camera's others: {}", odd.size(), SomeOf(odd)),
           "render or copy them again at the camera's size: K belongs to one size")
      .evidence = evidence;
}

bool IsUniform(const fs::path& path) {
  try {
    const ImageU8 image = ReadImage(path);
    const auto values = image.values();
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    return *high - *low < 8;
  } catch (const Error&) {
    return true;
  }
}

// The same bytes under several names.
void CheckDuplicates(Examination* e, const std::vector<ImageFile>& files) {
  std::map<uintmax_t, std::vector<const ImageFile*>> by_bytes;
  for (const ImageFile& file : files) {
    if (file.problem.empty()) by_bytes[file.bytes].push_back(&file);
  }
  std::map<uint64_t, std::vector<const ImageFile*>> by_hash;
  for (const auto& [bytes, group] : by_bytes) {
    if (group.size() < 2) continue;
    for (const ImageFile* file : group) by_hash[Hash(ReadFile(file->path))].push_back(file);
  }
  std::vector<int> images(e->cameras.size()), repeated(e->cameras.size());
  for (const ImageFile& file : files) ++images[file.camera];
  std::vector<std::string> pairs, copies;
  std::vector<std::pair<size_t, std::string>> repeats;  // camera, "a = b"
  std::set<std::string> copied_cameras;
  for (const auto& [hash, group] : by_hash) {
    if (group.size() < 2 || IsUniform(group[0]->path)) continue;
    // Which of them is in its place is not known.
    for (const ImageFile* file : group) e->doubtful.insert({file->frame, file->camera});
    for (size_t i = 1; i < group.size(); ++i) {
      const std::string pair = fmt::format("{} = {}", NameOf(*e, *group[i]), NameOf(*e, *group[0]));
      if (group[i]->camera != group[0]->camera) {
        copies.push_back(pair);
      } else {
        ++repeated[group[i]->camera];
        repeats.emplace_back(group[i]->camera, pair);
      }
    }
  }
  for (size_t c = 0; c < images.size(); ++c) {
    if (images[c] < 3 || repeated[c] < images[c] - 1) continue;
    e->Found("camera-frozen", Severity::kMustFix, "camera " + e->cameras[c].name,
             "all images of this camera are the same, though the frames differ",
             "export the camera's images again, or take it out of KRT")
        .evidence = fmt::format("{} identical files", images[c]);
  }
  for (const auto& [camera, pair] : repeats) {
    if (images[camera] < 3 || repeated[camera] < images[camera] - 1) pairs.push_back(pair);
  }
  std::sort(pairs.begin(), pairs.end());
  if (!pairs.empty()) {
    e->Found("frame-duplicated", Severity::kMustFix, pairs.front().substr(0, pairs.front().find(' ')),
             fmt::format("{} images are copies of another frame's: {}", pairs.size(), SomeOf(pairs)),
             "export these frames again, or take them off frame_list.txt");
  }
  if (!copies.empty()) {
    e->Found("camera-copied", Severity::kMustFix, copies.front().substr(0, copies.front().find(' ')),
             fmt::format("{} images are copies of another camera's: {}", copies.size(), SomeOf(copies)),
             "export the camera's images again");
  }
}

}  // namespace

void CheckImageFiles(Examination* e) {
  if (!e->multiface) return;
  std::vector<ImageFile> files = ListImages(e);
  if (!e->options.all && files.size() > kMostHeaders) {
    std::vector<ImageFile> chosen;
    for (const size_t i : EvenlySpread(files.size(), kMostHeaders)) chosen.push_back(files[i]);
    files = std::move(chosen);
  }
  Progress progress(e->options.all ? "read images" : "look at images", static_cast<int64_t>(files.size()), "images");
  ParallelFor(static_cast<int64_t>(files.size()), [&](int64_t i) {
    ReadHeader(&files[static_cast<size_t>(i)], e->options.all);
    progress.Advance();
  });
  progress.Finish();
  std::vector<std::string> unreadable;
  std::string problem;
  for (const ImageFile& file : files) {
    if (file.problem.empty()) continue;
    if (unreadable.empty()) problem = file.problem;
    unreadable.push_back(NameOf(*e, file));
  }
  if (!unreadable.empty()) {
    e->Found("image-unreadable", Severity::kMustFix, unreadable.front(),
             fmt::format("{} images cannot be read: {}", unreadable.size(), SomeOf(unreadable)), "copy them again")
        .evidence = problem;
  }
  CheckSizes(e, files);
  CheckDuplicates(e, files);
}

}  // namespace likeness
