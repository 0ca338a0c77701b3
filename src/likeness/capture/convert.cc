#include "likeness/capture/convert.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/interrupt.h"
#include "likeness/base/log.h"
#include "likeness/base/parallel.h"
#include "likeness/base/progress.h"
#include "likeness/capture/carry_textures.h"
#include "likeness/capture/derived_folder.h"
#include "likeness/capture/proxy_record.h"
#include "likeness/capture/writer.h"
#include "likeness/image/image_io.h"
#include "likeness/image/resize.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

enum class Transfer { kLinked, kCopied };

// Both ways the file appears under its final name only when it is whole.
Transfer TransferFile(const fs::path& from, const fs::path& to, bool link) {
  Transfer done = Transfer::kCopied;
  WriteFileWith(
      to,
      [&](const fs::path& temporary) {
        std::error_code code;
        if (link) fs::create_hard_link(fs::canonical(from), temporary, code);
        if (link && !code) {
          done = Transfer::kLinked;
        } else {
          fs::copy_file(from, temporary);  // another file system, or one that knows no links
        }
      },
      Sync::kNo);
  return done;
}

class Converter {
 public:
  Converter(const Capture& source, const ConvertOptions& options)
      : source_(source),
        options_(options),
        writer_(options.out),
        cameras_(SelectCameras(source, options.selection)),
        frames_(SelectFrames(source, options.selection)) {
    for (const Camera& camera : cameras_) {
      converted_.push_back(ConvertedCamera(camera, options));
      resized_ = resized_ || converted_.back().width != camera.width;
    }
  }

  ConvertReport Run() {
    CheckApart(source_.root(), options_.out);
    ClaimFolder(options_.out, "convert.json", "converted", Describe());
    WriteTables();
    WriteMeshes();
    WriteValidMasks();
    WriteImages();
    CarryConditions();
    CarryTextures();
    if (interrupt_.Requested()) {
      throw Error("interrupted: {} of {} images are in {}; the same command goes on from there", done_.load(),
                  frames_.size() * cameras_.size(), options_.out.string());
    }
    report_.cameras = static_cast<int>(cameras_.size());
    report_.frames = static_cast<int>(frames_.size());
    std::set<std::string> segments;
    for (const FrameId& frame : frames_) segments.insert(frame.segment);
    report_.segments = static_cast<int>(segments.size());
    report_.images_linked = linked_;
    report_.images_copied = copied_;
    report_.images_encoded = encoded_;
    report_.images_kept = kept_;
    report_.images_absent = absent_;
    report_.masks = masks_;
    return report_;
  }

 private:
  // What the files depend on.
  ordered_json Describe() const {
    std::vector<std::string> names;
    for (const Camera& camera : cameras_) names.push_back(camera.name);
    const CaptureSelection& s = options_.selection;
    return {{"source", AbsolutePath(source_.root()).string()},
            {"layout", source_.layout_name()},
            {"cameras", names},
            {"segments", s.segments},
            {"frames", s.frames},
            {"every", s.every},
            {"count", s.count},
            {"width", options_.width},
            {"scale", options_.scale},
            {"masks", options_.masks},
            {"textures", options_.textures}};
  }

  void WriteTables() {
    writer_.WriteCalibration(converted_);
    writer_.WriteFrameList(frames_);
    const Geometry geometry = GeometryOf(source_.root());
    if (geometry != Geometry::kTracked) WriteGeometry(options_.out, geometry);
    const Split split = ReduceSplit(source_.split(), cameras_);
    if (!split.held_out_cameras.empty() || !split.held_out_segments.empty() ||
        split.training_cameras.size() != cameras_.size()) {
      writer_.WriteSplit(split);
    }
    if (split.training_cameras.size() == cameras_.size() && !source_.split().held_out_cameras.empty()) {
      report_.dropped.emplace_back(cameras_.size() == source_.cameras().size()
                                       ? "the split of cameras"
                                       : "the split of cameras: what is left is all of one kind, and all of it trains");
    }
    if (std::all_of(frames_.begin(), frames_.end(),
                    [&](const FrameId& f) { return split.IsHeldOutSegment(f.segment); })) {
      LogWarning("every chosen segment is held out: there is nothing to train on");
    }
    for (const char* name : {"truth", "audio"}) {
      if (Exists(source_.root() / name)) report_.dropped.push_back(fmt::format("{}/", name));
    }
  }

  // A file that cannot be read is told and left out: one in a million must not end the work.
  template <typename Work>
  bool Guard(const Work& work) {
    try {
      work();
      return true;
    } catch (const Error& error) {
      LogWarning("{}", error.what());
      const std::lock_guard lock(mutex_);
      report_.unreadable.emplace_back(error.what());
      return false;
    }
  }

  void WriteMeshes() {
    const CaptureLayout& layout = writer_.layout();
    bool has_obj = false;
    for (const FrameId& frame : frames_) {
      has_obj = has_obj || Exists(layout.MeshObj(frame));
    }
    std::atomic<bool> needs_obj = !has_obj;
    Progress progress("convert meshes", static_cast<int64_t>(frames_.size()), "frames");
    ParallelFor(static_cast<int64_t>(frames_.size()), [&](int64_t i) {
      const FrameId& frame = frames_[static_cast<size_t>(i)];
      if (interrupt_.Requested()) return;
      if (Exists(layout.MeshBinary(frame)) && Exists(layout.HeadPose(frame))) return progress.Skip(1);
      TrackedFrame tracked;
      if (!Guard([&] { tracked = source_.ReadTracked(frame); })) return;
      // Faces and texture coordinates once: readers need no more.
      if (needs_obj.exchange(false)) writer_.WriteObj(frame, tracked.vertices_in_head, source_.topology());
      writer_.WriteTracked(frame, tracked);
      progress.Advance();
    });
    progress.Finish();
  }

  void WriteImages() {
    const auto cameras = static_cast<int64_t>(cameras_.size()), count = cameras * static_cast<int64_t>(frames_.size());
    Progress progress("convert images", count, "images");
    ParallelFor(count, [&](int64_t i) {
      if (interrupt_.Requested()) return;
      const FrameId& frame = frames_[static_cast<size_t>(i / cameras)];
      const auto camera = static_cast<size_t>(i % cameras);
      const bool kept = WriteImage(frame, cameras_[camera], converted_[camera]);
      if (options_.masks) WriteMask(frame, cameras_[camera], converted_[camera]);
      ++done_;
      kept ? progress.Skip(1) : progress.Advance();
    });
    progress.Finish();
  }

  // Pixels of undistorted cameras that show something; of smaller images, those that show nothing else.
  void WriteValidMasks() {
    for (size_t i = 0; i < cameras_.size(); ++i) {
      std::optional<ImageU8> valid = source_.ReadValidMask(cameras_[i]);
      if (!valid) continue;
      if (valid->width() != converted_[i].width || valid->height() != converted_[i].height) {
        valid = ResizeArea(*valid, converted_[i].width, converted_[i].height);
        for (uint8_t& value : valid->values()) value = value == 255 ? 255 : 0;
      }
      writer_.WriteValidMask(cameras_[i].name, *valid);
    }
  }

  // True when it was there.
  bool WriteImage(const FrameId& frame, const Camera& camera, const Camera& converted) {
    const fs::path to = writer_.layout().Image(frame, camera.name);
    if (LooksWholePng(to)) {
      ++kept_;
      return true;
    }
    if (!source_.HasCameraImage(frame, camera)) {
      ++absent_;
      return false;
    }
    const bool same_size = camera.width == converted.width && camera.height == converted.height;
    const std::optional<fs::path> from = same_size ? source_.ImageFile(frame, camera) : std::nullopt;
    if (from && LooksWholePng(*from)) {
      ++(TransferFile(*from, to, options_.link) == Transfer::kLinked ? linked_ : copied_);
      return false;
    }
    ImageU8 image;
    if (!Guard([&] { image = source_.ReadCameraImage(frame, camera); })) return false;
    if (!same_size) image = ResizeArea(image, converted.width, converted.height);
    WriteFile(to, EncodePng(image, 1), Sync::kNo);
    ++encoded_;
    return false;
  }

  void WriteMask(const FrameId& frame, const Camera& camera, const Camera& converted) {
    const fs::path to = writer_.layout().HeadMask(frame, camera.name);
    if (LooksWholePng(to)) return;
    std::optional<ImageU8> mask;
    if (!Guard([&] { mask = source_.ReadHeadMask(frame, camera); }) || !mask) return;
    if (mask->width() != converted.width || mask->height() != converted.height) {
      mask = ResizeArea(*mask, converted.width, converted.height);
      for (uint8_t& value : mask->values()) value = value >= 128 ? 255 : 0;
    }
    WriteFile(to, EncodePng(*mask, 1), Sync::kNo);
    ++masks_;
  }

  void CarryTextures() {
    if (!options_.textures || interrupt_.Requested()) return;
    if (source_.layout_name() != "Multiface") return CarryPublished();
    const TexturePlan plan = PlanTextures(source_, writer_.layout(), cameras_, frames_, resized_);
    report_.dropped.insert(report_.dropped.end(), plan.dropped.begin(), plan.dropped.end());
    if (plan.files.empty()) return;
    std::atomic<int64_t> carried = 0;
    Progress progress("carry textures", static_cast<int64_t>(plan.files.size()), "files");
    ParallelFor(static_cast<int64_t>(plan.files.size()), [&](int64_t i) {
      const auto& [from, to] = plan.files[static_cast<size_t>(i)];
      if (interrupt_.Requested() || Exists(to)) return progress.Skip(1);
      TransferFile(from, to, false);
      ++carried;
      progress.Advance();
    });
    report_.textures = carried;
  }

  // Whole: lines of frames that are left out do no harm.
  void CarryConditions() {
    const fs::path from = CaptureLayout(source_.root()).Conditions(), to = writer_.layout().Conditions();
    for (const std::string& name : ListFolder(from)) {
      if (name.ends_with(".csv") && !Exists(to / name)) TransferFile(from / name, to / name, false);
    }
  }

  // What publishers give beside the images has its own size and colours; of it only the statistics have a place.
  void CarryPublished() {
    std::optional<ImageU8> average;
    if (Guard([&] { average = source_.ReadAverageTexture(frames_.front()); }) && average) {
      report_.dropped.emplace_back("the publisher's average textures; likeness unwrap makes them from the images");
    }
    const CaptureLayout& layout = writer_.layout();
    std::optional<PublishedStatistics> statistics;
    if (Exists(layout.TextureMean()) || !Guard([&] { statistics = source_.ReadPublishedStatistics(); }) ||
        !statistics) {
      return;
    }
    if (cameras_.size() != source_.cameras().size() || frames_.size() != source_.frames().size()) {
      report_.dropped.emplace_back("the publisher's statistics: cameras or frames are left out");
      return;
    }
    WriteFile(layout.TextureVariance(), fmt::format("{}\n", statistics->texture_variance));
    WriteFloats(layout.VertexMean(), statistics->vertex_mean);
    WriteFile(layout.VertexVariance(), fmt::format("{}\n", statistics->vertex_variance));
    WritePng(layout.TextureMean(), statistics->texture_mean);
    report_.textures += 4;
  }

  const Capture& source_;
  const ConvertOptions& options_;
  const CaptureWriter writer_;
  const std::vector<Camera> cameras_;
  const std::vector<FrameId> frames_;
  std::vector<Camera> converted_;  // one for each of cameras_
  bool resized_ = false;
  const InterruptScope interrupt_;
  std::mutex mutex_;
  ConvertReport report_;
  std::atomic<int64_t> done_ = 0, linked_ = 0, copied_ = 0, encoded_ = 0, kept_ = 0, absent_ = 0, masks_ = 0;
};

}  // namespace

void ConvertOptions::Check() const {
  if (out.empty()) throw Error("a converted capture needs a folder to go to");
  if (width < 0 || width > 32768)
    throw Error("images have a width of 1 ... 32768 pixels (0: as they are), not {}", width);
  if (!(scale > 0 && scale <= 1)) throw Error("images are scaled by more than 0 and at most 1, not {}", scale);
  if (width > 0 && scale != 1) throw Error("give the images' width or their scale, not both");
  selection.Check();
}

Camera ConvertedCamera(const Camera& camera, const ConvertOptions& options) {
  if (options.width == 0 && options.scale == 1) return camera;
  if (camera.width == 0) {
    if (options.width > 0) {
      throw Error("camera {} has no image, so its size is unknown: leave it out with --cameras, or use --scale",
                  camera.name);
    }
    Camera scaled = camera;
    scaled.intrinsics.topRows<2>() *= options.scale;
    return scaled;
  }
  const double scale = options.width > 0 ? static_cast<double>(options.width) / camera.width : options.scale;
  if (scale > 1) {
    throw Error("camera {} has images {} pixels wide; they can be made smaller, not {} wide", camera.name, camera.width,
                options.width);
  }
  return camera.Resized(std::max(1, static_cast<int>(std::lround(camera.width * scale))),
                        std::max(1, static_cast<int>(std::lround(camera.height * scale))));
}

ConvertReport ConvertCapture(const Capture& source, const ConvertOptions& options) {
  options.Check();
  return Converter(source, options).Run();
}

}  // namespace likeness
