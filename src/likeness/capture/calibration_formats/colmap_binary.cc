#include <fmt/format.h>

#include <cstring>
#include <map>

#include "likeness/base/error.h"
#include "likeness/capture/calibration_formats/colmap_internal.h"

namespace likeness {
namespace {

// Little-endian values one after the other.
class BinaryReader {
 public:
  BinaryReader(std::filesystem::path path, std::string_view bytes) : path_(std::move(path)), rest_(bytes) {}

  template <typename T>
  T Read() {
    T value;
    std::memcpy(&value, Take(sizeof(T)).data(), sizeof(T));
    return value;
  }

  std::string_view ReadName() {
    const size_t length = rest_.find('\0');
    if (length == std::string_view::npos) Truncated();
    const std::string_view name = rest_.substr(0, length);
    rest_.remove_prefix(length + 1);
    return name;
  }

  void Skip(uint64_t count, size_t size) {
    if (count > rest_.size() / size) Truncated();
    rest_.remove_prefix(count * size);
  }

  // How many items follow; each takes `least` bytes or more.
  uint64_t ReadCount(size_t least) {
    const auto count = Read<uint64_t>();
    if (count > rest_.size() / least) {
      throw FileError(path_, fmt::format("says that {} items follow, but only {} bytes do: it is cut off, or no binary "
                                         "COLMAP model",
                                         count, rest_.size()));
    }
    return count;
  }

  void ExpectEnd() const {
    if (!rest_.empty()) throw FileError(path_, fmt::format("has {} bytes too many at its end", rest_.size()));
  }

  const std::filesystem::path& path() const { return path_; }

 private:
  [[noreturn]] void Truncated() const { throw FileError(path_, "ends in the middle of an item: it is cut off"); }

  std::string_view Take(size_t size) {
    if (rest_.size() < size) Truncated();
    const std::string_view taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }

  const std::filesystem::path path_;
  std::string_view rest_;
};

std::map<uint32_t, DistortedCamera> ParseCameras(BinaryReader reader) {
  std::map<uint32_t, DistortedCamera> cameras;
  for (uint64_t left = reader.ReadCount(24); left > 0; --left) {
    const auto id = reader.Read<uint32_t>();
    const colmap::Model& model = colmap::FindModel(reader.path(), int64_t{reader.Read<int32_t>()});
    const auto width = reader.Read<uint64_t>(), height = reader.Read<uint64_t>();
    std::vector<double> parameters(model.parameters);
    for (double& parameter : parameters) parameter = reader.Read<double>();
    const DistortedCamera camera = colmap::MakeCamera(reader.path(), model, width, height, parameters);
    if (!cameras.emplace(id, camera).second) {
      throw FileError(reader.path(), fmt::format("camera {} is described twice", id));
    }
  }
  reader.ExpectEnd();
  return cameras;
}

template <typename... Values>
void Append(std::string* bytes, Values... values) {
  (bytes->append(reinterpret_cast<const char*>(&values), sizeof(values)), ...);
}

}  // namespace

DistortedCameras ParseColmapBinary(const std::filesystem::path& folder, std::string_view cameras_bytes,
                                   std::string_view images_bytes) {
  const auto cameras = ParseCameras(BinaryReader(folder / "cameras.bin", cameras_bytes));
  BinaryReader reader(folder / "images.bin", images_bytes);
  DistortedCameras images;
  for (uint64_t left = reader.ReadCount(73); left > 0; --left) {
    reader.Read<uint32_t>();  // the image's own number
    std::array<double, 7> pose;
    for (double& value : pose) value = reader.Read<double>();
    const auto camera_id = reader.Read<uint32_t>();
    const std::string_view name = reader.ReadName();
    images.push_back(colmap::MakeImage(reader.path(), cameras, camera_id, pose, name));
    reader.Skip(reader.Read<uint64_t>(), 24);  // 2D points: x, y, number of the 3D point
  }
  reader.ExpectEnd();
  NameByImages(reader.path(), &images);
  CheckCameras(reader.path(), images);
  return images;
}

ColmapFiles FormatColmapBinary(const DistortedCameras& cameras, const std::vector<ColouredPoint>& points) {
  ColmapFiles files;
  Append(&files.cameras, uint64_t{cameras.size()});
  Append(&files.images, uint64_t{cameras.size()});
  Append(&files.points, uint64_t{points.size()});
  for (size_t i = 0; i < cameras.size(); ++i) {
    const DistortedCamera& source = cameras[i];
    const auto id = static_cast<uint32_t>(i + 1);
    Append(&files.cameras, id, int32_t{colmap::kPinholeId}, static_cast<uint64_t>(source.camera.width),
           static_cast<uint64_t>(source.camera.height));
    for (const double parameter : colmap::PinholeParameters(source)) Append(&files.cameras, parameter);
    Append(&files.images, id);
    for (const double value : colmap::Pose(source)) Append(&files.images, value);
    Append(&files.images, id);
    files.images += source.image.generic_string();
    files.images += '\0';
    Append(&files.images, uint64_t{0});
  }
  for (size_t i = 0; i < points.size(); ++i) {
    const auto& [position, rgb] = points[i];
    Append(&files.points, static_cast<uint64_t>(i + 1), position.x(), position.y(), position.z(), rgb[0], rgb[1],
           rgb[2], 0.0, uint64_t{0});
  }
  return files;
}

}  // namespace likeness
