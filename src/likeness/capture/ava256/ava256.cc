#include "likeness/capture/ava256/ava256.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/npy.h"
#include "likeness/base/parallel.h"
#include "likeness/base/text.h"
#include "likeness/capture/ava256/packed_folder.h"
#include "likeness/capture/ava256/sensor_scale.h"
#include "likeness/capture/ava256/tables.h"
#include "likeness/capture/calibration.h"
#include "likeness/capture/split_file.h"
#include "likeness/capture/undistort.h"
#include "likeness/geometry/obj.h"
#include "likeness/geometry/ply.h"
#include "likeness/image/image_io.h"
#include "likeness/image/resize.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMostText = 1 << 16;
constexpr uint64_t kMostMesh = 1 << 26;
constexpr uint64_t kMostPicture = 1 << 28;

bool HasFrameList(const fs::path& folder) {
  return Exists(folder / "frame_list.csv") || Exists(folder / "frame_splits_list.csv");
}

// The folder with the files: `root`, or what Ava-256 calls its decoder part.
fs::path DataFolder(const fs::path& root) { return Exists(root / "camera_calibration.json") ? root : root / "decoder"; }

// Pixel classes of segmentation_parts, by the publisher's data sheet.
enum PartClass : uint8_t { kBackground = 0, kChair = 3, kApparel = 4, kLastPart = 10 };

ImageU8 HeadMaskFromParts(const fs::path& path, ImageU8 parts) {
  for (uint8_t& value : parts.values()) {
    if (value > kLastPart) {
      throw FileError(path, fmt::format("holds the value {}; expected classes 0 to {} as grey levels", value,
                                        static_cast<int>(kLastPart)));
    }
    value = value == kBackground || value == kChair || value == kApparel ? 0 : 255;
  }
  return parts;
}

// Parts are also published at another size than the pictures.
ImageU8 ResizeMask(const ImageU8& mask, int width, int height) {
  if (mask.width() == width && mask.height() == height) return mask;
  ImageU8 resized = mask.width() > width ? ResizeArea(mask, width, height) : ResizeBilinear(mask, width, height);
  for (uint8_t& value : resized.values()) value = value >= 128 ? 255 : 0;
  return resized;
}

double ReadPositive(const fs::path& path) {
  const std::string text = ReadFile(path, kMostText);
  TextLines lines(path, text);
  const double value = lines.Next() ? lines.Numbers(1)[0] : 0;
  if (!(value > 0)) throw FileError(path, "expected one positive number");
  return value;
}

// What belongs to one camera. Masks are opened when first asked for, as many uses need none.
struct CameraFiles {
  std::optional<PackedFolder> pictures;
  std::once_flag parts_once;
  std::optional<PackedFolder> parts;
  Lens lens;  // to be undone; a pinhole where there is none, or it is ignored
  std::once_flag undistorter_once;
  std::optional<Undistorter> undistorter;
};

class Ava256Capture : public Capture {
 public:
  Ava256Capture(const fs::path& root, const CaptureOptions& options)
      : root_(root), data_(DataFolder(root)), goliath_(!Exists(data_ / "frame_list.csv")) {
    poses_ = Require(data_ / "head_pose", "head_pose", {".txt"});
    meshes_ = Require(data_ / "kinematic_tracking", "registration_vertices", {".ply"});
    averages_ = PackedFolder::Find(data_ / "uv_image", "color", {".avif", ".png", ".jpg"});
    FindCameras(options.distortion);
    FindFrames();
    FindTopology(options.topology_file);
    split_ = FindSplit(data_ / "split.json", options, cameras_);
    if (goliath_ && split_.held_out_segments.empty() && HasTestFrames()) split_.held_out_segments = {kTestPrefix};
  }

  const fs::path& root() const override { return root_; }
  std::string layout_name() const override { return goliath_ ? "Goliath" : "Ava-256"; }
  const std::vector<Camera>& cameras() const override { return cameras_; }
  const std::vector<FrameId>& frames() const override { return frames_; }
  const std::vector<SkippedFrame>& skipped_frames() const override { return skipped_; }
  const MeshTopology& topology() const override { return topology_; }
  const Split& split() const override { return split_; }

  TrackedFrame ReadTracked(const FrameId& frame) const override {
    const int64_t number = NumberOf(frame);
    TrackedFrame tracked;
    tracked.vertices_in_head = ReadMesh(number);
    if (tracked.vertices_in_head.rows() != topology_.vertex_count) {
      throw FileError(meshes_->NameOf(number), fmt::format("holds {} vertices; the faces are for {}",
                                                           tracked.vertices_in_head.rows(), topology_.vertex_count));
    }
    tracked.world_from_head = ParseTransform(poses_->NameOf(number), poses_->Read(number, kMostText));
    return tracked;
  }

  ImageU8 ReadCameraImage(const FrameId& frame, const Camera& camera) const override {
    const std::optional<PackedFolder>& pictures = FilesOf(camera).pictures;
    if (!pictures) throw FileError(data_ / "image" / ("cam" + camera.name + ".zip"), "no such file");
    const int64_t number = NumberOf(frame);
    const fs::path path = pictures->NameOf(number);
    ImageU8 image = DecodeImage(path, pictures->Read(number, kMostPicture));
    if (image.width() != camera.width || image.height() != camera.height) {
      throw FileError(path, fmt::format("is {} x {} pixels, but camera {} has {} x {}", image.width(), image.height(),
                                        camera.name, camera.width, camera.height));
    }
    const Undistorter* undistorter = UndistorterOf(camera);
    return undistorter != nullptr ? undistorter->Undistort(image) : std::move(image);
  }

  bool HasCameraImage(const FrameId& frame, const Camera& camera) const override {
    const std::optional<PackedFolder>& pictures = FilesOf(camera).pictures;
    return pictures && pictures->Has(NumberOf(frame));
  }

  bool HasHeadMask(const FrameId& frame, const Camera& camera) const override {
    const std::optional<PackedFolder>& parts = PartsOf(camera);
    return parts && parts->Has(NumberOf(frame));
  }

  std::optional<ImageU8> ReadHeadMask(const FrameId& frame, const Camera& camera) const override {
    const std::optional<PackedFolder>& parts = PartsOf(camera);
    const int64_t number = NumberOf(frame);
    if (!parts || !parts->Has(number)) return std::nullopt;
    const fs::path path = parts->NameOf(number);
    const ImageU8 classes = DecodeImage(path, parts->Read(number, kMostPicture), 1);
    ImageU8 mask = ResizeMask(HeadMaskFromParts(path, classes), camera.width, camera.height);
    const Undistorter* undistorter = UndistorterOf(camera);
    return undistorter != nullptr ? undistorter->UndistortMask(mask) : std::move(mask);
  }

  std::optional<ImageU8> ReadValidMask(const Camera& camera) const override {
    const Undistorter* undistorter = UndistorterOf(camera);
    if (undistorter == nullptr || undistorter->all_valid()) return std::nullopt;
    return undistorter->valid();
  }

  std::optional<fs::path> ImageFile(const FrameId& frame, const Camera& camera) const override {
    const std::optional<PackedFolder>& pictures = FilesOf(camera).pictures;
    if (!pictures || pictures->is_zip() || !pictures->Has(NumberOf(frame))) return std::nullopt;
    if (!FilesOf(camera).lens.IsPinhole()) return std::nullopt;
    return pictures->NameOf(NumberOf(frame));
  }

  std::optional<ImageU8> ReadAverageTexture(const FrameId& frame) const override {
    const int64_t number = NumberOf(frame);
    if (!averages_ || !averages_->Has(number)) return std::nullopt;
    return DecodeImage(averages_->NameOf(number), averages_->Read(number, kMostPicture));
  }

  std::optional<PublishedStatistics> ReadPublishedStatistics() const override {
    const fs::path texture = data_ / "uv_image", mesh = data_ / "kinematic_tracking";
    for (const fs::path& path :
         {texture / "color_mean.png", texture / "color_variance.txt", mesh / "registration_vertices_mean.npy",
          mesh / "registration_vertices_variance.txt"}) {
      if (!Exists(path)) return std::nullopt;
    }
    PublishedStatistics statistics;
    statistics.texture_mean = ReadImage(texture / "color_mean.png");
    statistics.texture_variance = ReadPositive(texture / "color_variance.txt");
    statistics.vertex_variance = ReadPositive(mesh / "registration_vertices_variance.txt");
    const fs::path path = mesh / "registration_vertices_mean.npy";
    const NpyArray mean = ParseNpy(path, ReadFile(path, kMostMesh));
    if (mean.values.size() != 3 * static_cast<size_t>(topology_.vertex_count)) {
      throw FileError(path, fmt::format("holds {} values; expected 3 for each of {} vertices", mean.values.size(),
                                        topology_.vertex_count));
    }
    for (const double value : mean.values) {
      if (!std::isfinite(value)) throw FileError(path, "holds a value that is not finite");
      statistics.vertex_mean.push_back(static_cast<float>(value));
    }
    return statistics;
  }

 private:
  static std::optional<PackedFolder> Require(const fs::path& parent, const std::string& name,
                                             std::vector<std::string> endings) {
    const std::string ending = endings.front();
    std::optional<PackedFolder> found = PackedFolder::Find(parent, name, std::move(endings), /*flat=*/true);
    if (!found) {
      throw FileError(parent / (name + ".zip"), fmt::format("no such file, and no folder {} with <frame>{} either",
                                                            (parent / name).string(), ending));
    }
    return found;
  }

  static int64_t NumberOf(const FrameId& frame) {
    int64_t number = -1;
    std::from_chars(frame.frame.data(), frame.frame.data() + frame.frame.size(), number);
    return number;
  }

  CameraFiles& FilesOf(const Camera& camera) const {
    const auto it = files_.find(camera.name);
    if (it == files_.end()) throw Error("{}: there is no camera '{}'", root_.string(), camera.name);
    return *it->second;
  }

  const std::optional<PackedFolder>& PartsOf(const Camera& camera) const {
    CameraFiles& files = FilesOf(camera);
    std::call_once(files.parts_once, [&] {
      files.parts = PackedFolder::Find(data_ / "segmentation_parts", "cam" + camera.name, {".png"});
    });
    return files.parts;
  }

  Vertices ReadMesh(int64_t number) const {
    return ParsePly(meshes_->NameOf(number), meshes_->Read(number, kMostMesh)).vertices;
  }

  // A damaged picture must not close the capture; several are no accident.
  static ImageInfo FirstPictureInfo(const PackedFolder& pictures) {
    constexpr size_t kTried = 3;
    const std::vector<int64_t> numbers = pictures.Numbers();
    for (size_t i = 0;; ++i) {
      try {
        return ReadImageInfo(pictures.NameOf(numbers[i]), pictures.Read(numbers[i], kMostPicture));
      } catch (const Error&) {
        if (i + 1 >= std::min(kTried, numbers.size())) throw;
      }
    }
  }

  void FindCameras(const std::string& distortion) {
    const fs::path path = data_ / "camera_calibration.json";
    std::vector<SensorCamera> sensors = ParseSensorCalibration(path, ReadFile(path));
    std::vector<std::unique_ptr<CameraFiles>> files(sensors.size());
    ParallelFor(static_cast<int64_t>(sensors.size()), [&](int64_t i) {
      files[i] = std::make_unique<CameraFiles>();
      Camera& camera = sensors[i].camera;
      files[i]->pictures = PackedFolder::Find(data_ / "image", "cam" + camera.name, {".avif", ".png", ".jpg"});
      if (!files[i]->pictures || files[i]->pictures->size() == 0) return;
      const ImageInfo info = FirstPictureInfo(*files[i]->pictures);
      camera.width = info.width;
      camera.height = info.height;
    });
    // A dome has more cameras than are published; without any pictures, the calibration is all there is.
    const bool any = std::any_of(sensors.begin(), sensors.end(), [](const auto& s) { return s.camera.width > 0; });
    std::vector<SensorCamera> kept;
    for (size_t i = 0; i < sensors.size(); ++i) {
      if (any && sensors[i].camera.width == 0) continue;
      files_[sensors[i].camera.name] = std::move(files[i]);
      kept.push_back(std::move(sensors[i]));
    }
    cameras_ = ScaleToPictures(path, kept, goliath_ ? PixelCentre::kZero : PixelCentre::kHalf);
    FindLenses(path, kept, distortion);
  }

  void FindLenses(const fs::path& path, const std::vector<SensorCamera>& sensors, const std::string& distortion) {
    size_t distorted = 0;
    double shift = 0;
    for (size_t i = 0; i < sensors.size(); ++i) {
      if (sensors[i].lens.IsPinhole()) continue;
      ++distorted;
      shift = std::max(shift, sensors[i].LargestShiftPx(cameras_[i]));
      if (distortion == "undistort") files_[cameras_[i].name]->lens = sensors[i].lens;
    }
    if (distorted == 0 || distortion == "undistort") return;
    const std::string what = fmt::format("{} of {} cameras have lens distortion, which moves pixels by up to {:.1f} px",
                                         distorted, sensors.size(), shift);
    if (distortion == "ignore") return LogWarning("{}: {}; it is ignored", path.string(), what);
    throw FileError(path, what +
                              "; --distortion undistort resamples the pictures, --distortion ignore takes them as "
                              "undistorted, as the publishers' own loaders do");
  }

  // Null where there is nothing to undo.
  const Undistorter* UndistorterOf(const Camera& camera) const {
    CameraFiles& files = FilesOf(camera);
    if (files.lens.IsPinhole() || camera.width == 0) return nullptr;
    std::call_once(files.undistorter_once, [&] {
      const Camera& own = FindCamera(camera.name);
      files.undistorter.emplace(DistortedCamera{own, files.lens, {}, {}}, own);
    });
    return &*files.undistorter;
  }

  std::vector<ListedFrame> ListFrames() const {
    if (!goliath_) return ParseFrameListCsv(data_ / "frame_list.csv", ReadFile(data_ / "frame_list.csv"));
    const fs::path splits = data_ / "frame_splits_list.csv", segments = data_ / "frame_segments_list.csv";
    return ParseFrameSplitsCsv(splits, ReadFile(splits), segments, Exists(segments) ? ReadFile(segments) : "");
  }

  void FindFrames() {
    std::set<int64_t> seen;
    for (const ListedFrame& listed : ListFrames()) {
      const FrameId frame = {listed.segment, fmt::format("{:06}", listed.number)};
      std::string reason;
      if (!seen.insert(listed.number).second) reason = "is listed twice";
      for (const auto* folder : {&*meshes_, &*poses_}) {
        if (reason.empty() && !folder->Has(listed.number)) {
          reason = folder->NameOf(listed.number).lexically_relative(data_).string() + " is absent";
        }
      }
      if (reason.empty()) {
        frames_.push_back(frame);
      } else {
        skipped_.push_back({frame, reason});
      }
    }
    if (frames_.empty()) {
      throw FileError(data_, fmt::format("none of the {} listed frames has a mesh and a head pose: {}", skipped_.size(),
                                         skipped_.front().reason));
    }
  }

  bool HasTestFrames() const {
    return std::any_of(frames_.begin(), frames_.end(),
                       [](const FrameId& f) { return f.segment.starts_with(kTestPrefix); });
  }

  void FindTopology(fs::path path) {
    const fs::path absolute = fs::absolute(data_).lexically_normal();
    const std::vector<fs::path> candidates = {data_ / "kinematic_tracking" / "template_mesh.obj",
                                              data_ / "face_topology.obj", absolute.parent_path() / "face_topology.obj",
                                              absolute.parent_path().parent_path() / "face_topology.obj"};
    for (const fs::path& candidate : candidates) {
      if (path.empty() && Exists(candidate)) path = candidate;
    }
    if (path.empty()) {
      throw FileError(data_,
                      fmt::format("no faces and texture coordinates: {} captures hold none of their own; name an "
                                  ".obj with --topology, or lay it beside the capture as face_topology.obj "
                                  "(Ava-256's stands in the assets of its code)",
                                  layout_name()));
    }
    topology_ = TopologyFromObj(ReadObj(path), path.string());
    topology_.Check(path.string());
    if (topology_.triangles.empty()) throw FileError(path, "has no faces");
    const int64_t first = NumberOf(frames_.front());
    if (const Eigen::Index rows = ReadMesh(first).rows(); rows != topology_.vertex_count) {
      throw FileError(path, fmt::format("is for {} vertices, but {} has {}; name the right one with --topology",
                                        topology_.vertex_count, meshes_->NameOf(first).string(), rows));
    }
  }

  const fs::path root_;
  const fs::path data_;
  const bool goliath_;
  std::optional<PackedFolder> poses_, meshes_, averages_;
  std::map<std::string, std::unique_ptr<CameraFiles>> files_;  // by camera
  std::vector<Camera> cameras_;
  std::vector<FrameId> frames_;
  std::vector<SkippedFrame> skipped_;
  MeshTopology topology_;
  Split split_;
};

}  // namespace

bool IsAva256(const fs::path& root) {
  const fs::path data = DataFolder(root);
  return Exists(data / "camera_calibration.json") && HasFrameList(data);
}

std::unique_ptr<Capture> OpenAva256(const fs::path& root, const CaptureOptions& options) {
  return std::make_unique<Ava256Capture>(root, options);
}

}  // namespace likeness
