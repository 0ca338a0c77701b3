// Writes any capture as Ava-256 or Goliath would publish it, for tests.

#pragma once

#include <fmt/format.h>
#include <zip.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/npy.h"
#include "likeness/capture/capture.h"
#include "likeness/geometry/obj.h"
#include "likeness/geometry/ply.h"
#include "likeness/image/avif.h"
#include "likeness/image/image_io.h"

namespace likeness {

using NamedBytes = std::vector<std::pair<std::string, std::string>>;

inline void WriteZip(const std::filesystem::path& path, const NamedBytes& files, bool deflate = false) {
  std::filesystem::create_directories(path.parent_path());
  int code = 0;
  zip_t* zip = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
  LIKENESS_CHECK(zip != nullptr);
  for (const auto& [name, bytes] : files) {
    zip_source_t* source = zip_source_buffer(zip, bytes.data(), bytes.size(), 0);
    const zip_int64_t index = zip_file_add(zip, name.c_str(), source, 0);
    LIKENESS_CHECK(index >= 0);
    zip_set_file_compression(zip, static_cast<zip_uint64_t>(index), deflate ? ZIP_CM_DEFLATE : ZIP_CM_STORE, 0);
  }
  LIKENESS_CHECK(zip_close(zip) == 0);
}

struct TestFolderOptions {
  bool goliath = false;
  bool avif = true;                               // else PNG
  int quantizer = 0;                              // of AVIF; 0 is without loss
  bool packed = true;                             // else folders
  int sensor_width = 2668, sensor_height = 4096;  // what K is written for
  std::array<double, 4> distortion = {};
  PlyEncoding ply = PlyEncoding::kLittleEndian;
  std::filesystem::path topology;  // default: face_topology.obj in the folder, or Goliath's template_mesh.obj
};

class TestFolder {
 public:
  TestFolder(std::filesystem::path root, const TestFolderOptions& options)
      : options_(options), data_(options.goliath ? root : root / "decoder") {}

  const std::filesystem::path& data() const { return data_; }

  void Write(const Capture& source) const {
    WriteFile(data_ / "camera_calibration.json", Calibration(source.cameras()));
    WriteFrameList(source.frames());
    NamedBytes poses, meshes;
    for (const FrameId& frame : source.frames()) {
      const TrackedFrame tracked = source.ReadTracked(frame);
      poses.emplace_back(frame.frame + ".txt", PoseText(tracked.world_from_head));
      meshes.emplace_back((options_.goliath ? "registration_vertices/" : "") + frame.frame + ".ply",
                          EncodePly(tracked.vertices_in_head, {}, options_.ply));
    }
    Pack(data_ / "head_pose" / "head_pose", poses);
    Pack(data_ / "kinematic_tracking" / "registration_vertices", meshes, /*deflate=*/true);
    for (const Camera& camera : source.cameras()) WriteCamera(source, camera);
    const std::filesystem::path topology =
        !options_.topology.empty()
            ? options_.topology
            : data_ / (options_.goliath ? "kinematic_tracking/template_mesh.obj" : "face_topology.obj");
    WriteObj(topology, source.ReadTracked(source.frames().front()).vertices_in_head, source.topology());
  }

  // Average textures of one grey level a frame, and statistics.
  void WriteTextures(const Capture& source, int size) const {
    NamedBytes averages;
    for (size_t i = 0; i < source.frames().size(); ++i) {
      const ImageU8 texture(size, size, 3, static_cast<uint8_t>(10 * i + 10));
      averages.emplace_back("color/" + source.frames()[i].frame + Ending(), EncodePicture(texture));
    }
    Pack(data_ / "uv_image" / "color", averages);
    WritePng(data_ / "uv_image" / "color_mean.png", ImageU8(size, size, 3, 77));
    WriteFile(data_ / "uv_image" / "color_variance.txt", "123.5\n");
    const int count = source.topology().vertex_count;
    WriteFile(data_ / "kinematic_tracking" / "registration_vertices_mean.npy",
              EncodeNpy({count, 3}, std::vector<float>(3 * static_cast<size_t>(count), 2.5f)));
    WriteFile(data_ / "kinematic_tracking" / "registration_vertices_variance.txt", "4.25\n");
  }

  void Pack(const std::filesystem::path& name, const NamedBytes& files, bool deflate = false) const {
    if (options_.packed) return WriteZip(name.string() + ".zip", files, deflate);
    for (const auto& [inner, bytes] : files) {
      WriteFile(name / std::filesystem::path(inner).filename(), bytes);
    }
  }

 private:
  std::string Ending() const { return options_.avif ? ".avif" : ".png"; }
  std::string EncodePicture(const ImageU8& image) const {
    return options_.avif ? EncodeAvif(image, options_.quantizer) : EncodePng(image);
  }

  static std::string PoseText(const RigidTransform& pose) {
    std::string text;
    for (int row = 0; row < 3; ++row) {
      text += fmt::format("{} {} {} {}\n", pose.rotation(row, 0), pose.rotation(row, 1), pose.rotation(row, 2),
                          pose.translation[row]);
    }
    return text;
  }

  std::string Calibration(const std::vector<Camera>& cameras) const {
    nlohmann::json list = nlohmann::json::array();
    for (const Camera& camera : cameras) {
      Eigen::Matrix3d k = camera.intrinsics;
      k.row(0) *= static_cast<double>(options_.sensor_width) / camera.width;
      k.row(1) *= static_cast<double>(options_.sensor_height) / camera.height;
      if (options_.goliath) k(0, 2) -= 0.5, k(1, 2) -= 0.5;
      Eigen::Matrix4d t = Eigen::Matrix4d::Identity();
      t.topLeftCorner<3, 3>() = camera.cam_from_world.rotation;
      t.topRightCorner<3, 1>() = camera.cam_from_world.translation;
      nlohmann::json record = {{"cameraId", camera.name}, {"distortion", options_.distortion}};
      for (int row = 0; row < 3; ++row) record["K"].push_back({k(0, row), k(1, row), k(2, row)});
      for (int row = 0; row < 4; ++row) record["T"].push_back({t(0, row), t(1, row), t(2, row), t(3, row)});
      list.push_back(record);
    }
    return nlohmann::json{{"KRT", list}}.dump(1);
  }

  void WriteFrameList(const std::vector<FrameId>& frames) const {
    std::string list = "seg_id,frame_id\n", splits = "frame,split\n", segments = "frame,segment_name\n";
    for (size_t i = 0; i < frames.size(); ++i) {
      list += frames[i].segment + ',' + frames[i].frame + '\n';
      splits += frames[i].frame + (i + 1 == frames.size() ? ",test\n" : ",train\n");
      segments += frames[i].frame + ',' + frames[i].segment + '\n';
    }
    if (options_.goliath) {
      WriteFile(data_ / "frame_splits_list.csv", splits);
      WriteFile(data_ / "frame_segments_list.csv", segments);
    } else {
      WriteFile(data_ / "frame_list.csv", list);
    }
  }

  void WriteCamera(const Capture& source, const Camera& camera) const {
    NamedBytes pictures, parts;
    for (const FrameId& frame : source.frames()) {
      const std::string inner = "cam" + camera.name + "/" + frame.frame;
      if (source.HasCameraImage(frame, camera)) {
        pictures.emplace_back(inner + Ending(), EncodePicture(source.ReadCameraImage(frame, camera)));
      }
      if (std::optional<ImageU8> mask = source.ReadHeadMask(frame, camera)) {
        constexpr uint8_t kHead[] = {1, 2, 5, 6, 7, 8, 9, 10}, kOther[] = {0, 3, 4};
        size_t i = 0;
        for (uint8_t& value : mask->values()) value = value != 0 ? kHead[i++ % 8] : kOther[i++ % 3];
        parts.emplace_back(inner + ".png", EncodePng(*mask));
      }
    }
    Pack(data_ / "image" / ("cam" + camera.name), pictures);
    if (!parts.empty()) Pack(data_ / "segmentation_parts" / ("cam" + camera.name), parts);
  }

  const TestFolderOptions options_;
  const std::filesystem::path data_;
};

}  // namespace likeness
