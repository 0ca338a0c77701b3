#include "likeness/capture/import/import_capture.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/interrupt.h"
#include "likeness/base/parallel.h"
#include "likeness/base/progress.h"
#include "likeness/base/random.h"
#include "likeness/base/text.h"
#include "likeness/capture/import/file_pattern.h"
#include "likeness/capture/import/import_meshes.h"
#include "likeness/capture/import/read_calibration.h"
#include "likeness/capture/writer.h"
#include "likeness/image/image_io.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

// "9" before "10", also where frames are not padded.
bool InOrder(const FrameId& a, const FrameId& b) {
  const auto key = [](const FrameId& f) {
    const bool number = f.frame.find_first_not_of("0123456789") == std::string::npos;
    const size_t zeros = number ? std::min(f.frame.find_first_not_of('0'), f.frame.size()) : 0;
    return std::tuple(std::string_view(f.segment), number ? f.frame.size() - zeros : 0,
                      std::string_view(f.frame).substr(zeros), std::string_view(f.frame));
  };
  return key(a) < key(b);
}

class Importer {
 public:
  explicit Importer(const ImportOptions& options) : options_(options), writer_(options.out) {}

  ImportResult Run() {
    sources_ = ReadCalibration(options_.kind, options_.source, options_.fisheye);
    Scale(&sources_, MillimetresPer(options_.unit) * options_.scale);
    FindImages();
    FindMasks();
    FindSizes();
    CheckSameOptions();
    for (const DistortedCamera& source : sources_) targets_.push_back(TargetOf(source));
    result_.cameras = static_cast<int>(sources_.size());
    result_.frames = static_cast<int>(frames_.size());
    writer_.WriteCalibration(targets_);
    writer_.WriteFrameList(frames_);
    ImportImages();
    if (options_.meshes.empty()) {
      result_.remarks.emplace_back(
          "no tracked meshes: inspect, unwrap and train need tracked_mesh/<segment>/<frame>.bin, _transform.txt and "
          "one "
          ".obj; give --meshes (and --poses, or --mesh-space world) once a tracker has made them, and run this again");
    } else {
      ImportMeshes(options_, frames_, targets_, &result_);
    }
    AddRemarks();
    return std::move(result_);
  }

 private:
  struct Item {
    fs::path image, mask;
  };

  // The frame that a pattern without {segment} or {frame} speaks of.
  static FrameId FrameOf(const PatternParts& parts) {
    return {parts.segment.empty() ? "capture" : parts.segment, parts.frame.empty() ? "000000" : parts.frame};
  }

  void FindImages() {
    if (options_.images.empty()) {
      frames_ = {FrameOf({})};
      for (const DistortedCamera& source : sources_) {
        if (source.image.empty()) {
          throw Error(
              "calibrations of kind {} name no images: give --images 'DIR/{{segment}}/{{camera}}/{{frame}}.png'",
              options_.kind);
        }
        if (Exists(source.image)) items_[frames_[0]][source.camera.name] = {source.image, source.mask};
      }
      if (items_.empty()) throw FileError(sources_[0].image, "no such image, nor any other that the calibration names");
      return;
    }
    std::set<std::string> known, unknown;
    std::vector<std::string> names;
    for (const DistortedCamera& source : sources_)
      known.insert(source.camera.name), names.push_back(source.camera.name);
    for (const auto& [parts, path] : FindFiles(options_.images)) {
      if (parts.camera.empty()) throw Error("--images '{}': expected {{camera}} in it", options_.images);
      if (known.contains(parts.camera)) {
        items_[FrameOf(parts)][parts.camera].image = path;
      } else {
        unknown.insert(parts.camera);
      }
    }
    if (items_.empty()) {
      throw Error("--images '{}': no image is of a camera of the calibration; images are of {}, the calibration has {}",
                  options_.images, fmt::join(unknown, ", "), fmt::join(names, ", "));
    }
    if (!unknown.empty()) {
      result_.remarks.push_back(
          fmt::format("images of {} cameras were left out, as the calibration does not have them: "
                      "{}",
                      unknown.size(), fmt::join(unknown, ", ")));
    }
    for (const auto& item : items_) frames_.push_back(item.first);
    std::sort(frames_.begin(), frames_.end(), InOrder);
  }

  void FindMasks() {
    if (options_.masks.empty()) return;
    for (const auto& [parts, path] : FindFiles(options_.masks)) {
      const auto frame = items_.find(FrameOf(parts));
      if (frame == items_.end()) continue;
      if (const auto item = frame->second.find(parts.camera); item != frame->second.end()) item->second.mask = path;
    }
  }

  // A calibration may give no size, or be of the same images at another one.
  void FindSizes() {
    std::erase_if(sources_, [&](const DistortedCamera& source) {
      const fs::path* image = FirstImage(source.camera.name);
      if (image == nullptr) without_images_.push_back(source.camera.name);
      return image == nullptr;
    });
    std::vector<std::string> resized;
    for (DistortedCamera& source : sources_) {
      Camera& camera = source.camera;
      const fs::path& path = *FirstImage(camera.name);
      const ImageInfo info = ReadImageInfo(path);
      if (info.width < 2 || info.height < 2) throw FileError(path, "is smaller than 2 x 2 pixels");
      if (camera.width == 0) camera.width = info.width, camera.height = info.height;
      if (camera.width == info.width && camera.height == info.height) continue;
      const double x = static_cast<double>(info.width) / camera.width;
      const double y = static_cast<double>(info.height) / camera.height;
      if (std::abs(x / y - 1) > 0.01) {
        throw FileError(path, fmt::format("is {} x {} pixels; camera {} was calibrated at {} x {}, another shape",
                                          info.width, info.height, camera.name, camera.width, camera.height));
      }
      camera = camera.Resized(info.width, info.height);
      resized.push_back(camera.name);
    }
    if (!resized.empty()) {
      result_.remarks.push_back(
          fmt::format("{} cameras were calibrated at another size than their images have; K was "
                      "scaled to the images",
                      resized.size()));
    }
  }

  const fs::path* FirstImage(const std::string& camera) const {
    for (const FrameId& frame : frames_) {
      const auto& items = items_.at(frame);
      if (const auto it = items.find(camera); it != items.end() && !it->second.image.empty()) return &it->second.image;
    }
    return nullptr;
  }

  Camera TargetOf(const DistortedCamera& source) const {
    const auto side = [&](int px) { return std::max(2, static_cast<int>(std::lround(px / options_.shrink))); };
    return options_.shrink == 1 ? source.camera
                                : source.camera.Resized(side(source.camera.width), side(source.camera.height));
  }

  // import.json: what the images were made with.
  void CheckSameOptions() const {
    std::string calibration;
    for (const DistortedCamera& source : sources_) {
      const auto numbers = [&](const auto& values) {
        for (const double v : values.reshaped()) calibration += fmt::format("{} ", v);
      };
      calibration += source.camera.name + ' ' + source.lens.Describe() + ' ';
      numbers(source.camera.intrinsics);
      calibration += fmt::format("{} {} ", source.camera.width, source.camera.height);
    }
    const nlohmann::ordered_json now = {{"intrinsics", fmt::format("{:016x}", Hash(calibration))},
                                        {"images", options_.images},
                                        {"masks", options_.masks},
                                        {"shrink", options_.shrink}};
    const fs::path path = options_.out / "import.json";
    if (Exists(path)) {
      if (nlohmann::ordered_json::parse(ReadFile(path, 1 << 20), nullptr, false) != now) {
        throw FileError(options_.out,
                        "holds images that were imported with other options or another calibration; "
                        "remove it or name another folder");
      }
    } else if (!ListFolder(options_.out).empty()) {
      throw FileError(options_.out, "holds something that was not imported; name another folder");
    }
    WriteFile(path, now.dump(2) + '\n');
  }

  void ImportImages() {
    Progress progress("import " + options_.kind, static_cast<int64_t>(sources_.size() * frames_.size()), "images");
    const auto cameras = static_cast<int64_t>(sources_.size());
    // A camera's map of pixels is made once, so its frames go together; side by side while there are enough of them.
    if (static_cast<int64_t>(frames_.size()) >= 2 * ThreadCount()) {
      for (int64_t i = 0; i < cameras; ++i) ImportCamera(static_cast<size_t>(i), &progress);
    } else {
      ParallelFor(cameras, [&](int64_t i) { ImportCamera(static_cast<size_t>(i), &progress); });
    }
    progress.Finish();
    if (interrupt_.Requested()) {
      throw Error("interrupted: {} images are done; the same command goes on from there", written_ + copied_ + kept_);
    }
    result_.images_written = written_;
    result_.images_copied = copied_;
    result_.images_kept = kept_;
    result_.images_absent = absent_;
    result_.valid_masks = valid_masks_;
  }

  void ImportCamera(size_t index, Progress* progress) {
    if (interrupt_.Requested()) return;
    const DistortedCamera& source = sources_[index];
    const Camera& target = targets_[index];
    std::unique_ptr<Undistorter> undistorter;
    if (!IsSameImage(source, target)) {
      undistorter = std::make_unique<Undistorter>(source, target);
      if (!undistorter->all_valid()) {
        writer_.WriteValidMask(target.name, undistorter->valid());
        ++valid_masks_;
      }
    }
    ParallelFor(static_cast<int64_t>(frames_.size()), [&](int64_t i) {
      if (interrupt_.Requested()) return;
      const FrameId& frame = frames_[static_cast<size_t>(i)];
      const auto& items = items_.at(frame);
      const auto it = items.find(source.camera.name);
      if (it == items.end() || it->second.image.empty()) {
        ++absent_;
        progress->Skip(1);
        return;
      }
      if (!it->second.mask.empty()) ImportMask(source, frame, it->second.mask, undistorter.get());
      const fs::path out = writer_.layout().Image(frame, target.name);
      if (LooksWholePng(out)) {
        ++kept_;
        progress->Skip(1);
        return;
      }
      ImportImage(source, it->second.image, out, undistorter.get());
      progress->Advance();
    });
  }

  ImageU8 ReadChecked(const DistortedCamera& source, const fs::path& path, int channels) const {
    ImageU8 image = ReadImage(path, channels);
    if (image.width() != source.camera.width || image.height() != source.camera.height) {
      throw FileError(path, fmt::format("is {} x {} pixels; others of camera {} have {} x {}", image.width(),
                                        image.height(), source.camera.name, source.camera.width, source.camera.height));
    }
    return image;
  }

  void ImportImage(const DistortedCamera& source, const fs::path& path, const fs::path& out,
                   const Undistorter* undistorter) {
    if (undistorter == nullptr && LooksWholePng(path)) {
      const ImageInfo info = ReadImageInfo(path);
      if (info.width == source.camera.width && info.height == source.camera.height) {
        WriteFileWith(
            out, [&](const fs::path& to) { fs::copy_file(path, to, fs::copy_options::overwrite_existing); }, Sync::kNo);
        ++copied_;
        return;
      }
    }
    ImageU8 image = ReadChecked(source, path, 3);
    if (undistorter != nullptr) image = undistorter->Undistort(image);
    WriteFile(out, EncodePng(image, 1), Sync::kNo);
    ++written_;
  }

  void ImportMask(const DistortedCamera& source, const FrameId& frame, const fs::path& path,
                  const Undistorter* undistorter) {
    has_masks_ = true;
    const fs::path out = writer_.layout().HeadMask(frame, source.camera.name);
    if (LooksWholePng(out)) return;
    ImageU8 mask = ReadChecked(source, path, 1);
    for (uint8_t& value : mask.values()) value = value >= 128 ? 255 : 0;
    if (undistorter != nullptr) mask = undistorter->UndistortMask(mask);
    WriteFile(out, EncodePng(mask, 1), Sync::kNo);
  }

  void AddRemarks() {
    std::vector<std::string>& remarks = result_.remarks;
    result_.distance_to_focus_mm = DistanceToFocus(sources_);
    if (const double d = result_.distance_to_focus_mm; d > 0 && (d < 150 || d > 10000)) {
      remarks.push_back(
          fmt::format("the cameras stand {:.4g} mm from the point that they look at, which is no distance "
                      "to a head: give --unit, or --scale to bring the calibration to millimetres",
                      d));
    }
    if (!without_images_.empty()) {
      remarks.push_back(fmt::format("{} cameras of the calibration have no images and were left out: {}",
                                    without_images_.size(), fmt::join(without_images_, ", ")));
    }
    if (result_.images_absent > 0) {
      remarks.push_back(fmt::format("{} images are absent from their frames", result_.images_absent));
    }
    if (!has_masks_) remarks.emplace_back("no head masks (--masks): the mesh's outline stands in for them");
    remarks.emplace_back("no camera or segment is held out; write split.json to judge by them");
  }

  const ImportOptions& options_;
  const CaptureWriter writer_;
  const InterruptScope interrupt_;
  DistortedCameras sources_;  // mm
  std::vector<Camera> targets_;
  std::vector<FrameId> frames_;
  std::map<FrameId, std::map<std::string, Item>> items_;  // by camera
  std::vector<std::string> without_images_;
  ImportResult result_;
  std::atomic<int> written_ = 0, copied_ = 0, kept_ = 0, absent_ = 0, valid_masks_ = 0;
  std::atomic<bool> has_masks_ = false;
};

}  // namespace

void ImportOptions::Check() const {
  if (out.empty()) throw Error("an imported capture needs a folder to go to");
  MillimetresPer(unit);
  if (mesh_unit != "same") MillimetresPer(mesh_unit);
  if (!(scale > 0 && scale < 1e9)) throw Error("--scale {}: expected a positive number", scale);
  if (!(shrink >= 1 && shrink <= 16)) throw Error("--shrink {}: expected 1 to 16", shrink);
  if (mesh_space != "head" && mesh_space != "world") throw Error("--mesh-space {}: expected head or world", mesh_space);
  if (mesh_space == "world" && !poses.empty())
    throw Error(
        "--poses go with --mesh-space head; in world space they are "
        "found from the meshes");
  if (meshes.empty() && !(poses.empty() && topology.empty())) throw Error("--poses and --topology go with --meshes");
}

ImportResult ImportCapture(const ImportOptions& options) {
  options.Check();
  return Importer(options).Run();
}

}  // namespace likeness
