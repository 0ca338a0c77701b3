#include "likeness/capture/calibration_formats/opencv_storage.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "likeness/base/error.h"
#include "likeness/capture/layout.h"

namespace likeness {
namespace {

enum class Field { kK, kD, kR, kT, kWidth, kHeight, kSize, kFisheye, kModel };

// Lower case; of two that fit, the longer one is meant.
constexpr std::pair<std::string_view, Field> kNames[] = {{"camera_matrix", Field::kK},
                                                         {"cameramatrix", Field::kK},
                                                         {"intrinsic_matrix", Field::kK},
                                                         {"intrinsics", Field::kK},
                                                         {"k", Field::kK},
                                                         {"m", Field::kK},
                                                         {"distortion_coeffs", Field::kD},
                                                         {"distortion_coefficients", Field::kD},
                                                         {"dist_coeffs", Field::kD},
                                                         {"distcoeffs", Field::kD},
                                                         {"distortion", Field::kD},
                                                         {"dist", Field::kD},
                                                         {"d", Field::kD},
                                                         {"rotation_matrix", Field::kR},
                                                         {"rotation", Field::kR},
                                                         {"rot", Field::kR},
                                                         {"r", Field::kR},
                                                         {"rvec", Field::kR},
                                                         {"translation_vector", Field::kT},
                                                         {"translation", Field::kT},
                                                         {"tvec", Field::kT},
                                                         {"t", Field::kT},
                                                         {"image_width", Field::kWidth},
                                                         {"width", Field::kWidth},
                                                         {"w", Field::kWidth},
                                                         {"image_height", Field::kHeight},
                                                         {"height", Field::kHeight},
                                                         {"h", Field::kHeight},
                                                         {"image_size", Field::kSize},
                                                         {"fisheye_model", Field::kFisheye},
                                                         {"distortion_model", Field::kModel}};

struct Key {
  Field field = Field::kK;
  std::string camera;  // "" without an ending
};

// "dist_coeffs_left" -> distortion of "left", "K1" -> K of "1"; none for other words.
std::optional<Key> Classify(const std::string& word) {
  std::string lower = word;
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  std::optional<Key> best;
  size_t longest = 0;
  for (const auto& [name, field] : kNames) {
    if (name.size() <= longest || !lower.starts_with(name)) continue;
    std::string ending = word.substr(name.size());
    const bool is_number = !ending.empty() && ending.find_first_not_of("0123456789") == std::string::npos;
    if (!ending.empty() && !is_number && ending[0] != '_') continue;
    if (ending.starts_with('_')) ending.erase(0, 1);
    best = Key{field, ending};
    longest = name.size();
  }
  return best;
}

// One camera's values and where they stand.
struct Source {
  const std::filesystem::path* path = nullptr;
  std::map<Field, const StorageNode*> fields;
};

[[noreturn]] void Fail(const std::filesystem::path& path, const StorageNode& node, const std::string& message) {
  if (node.line > 0) throw FileError(path, node.line, message);
  throw FileError(path, message);
}

double Number(const std::filesystem::path& path, const StorageNode& node) {
  double value = 0;
  const std::string& word = node.scalar;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (node.kind != StorageNode::Kind::kScalar || code != std::errc() || end != word.data() + word.size() ||
      !std::isfinite(value)) {
    Fail(path, node, fmt::format("expected a finite number, found '{}'", word.substr(0, 40)));
  }
  return value;
}

// A matrix ({rows, cols, dt, data}), a list, or a list of lists; row by row.
std::vector<double> Numbers(const std::filesystem::path& path, const StorageNode& node) {
  std::vector<double> values;
  if (node.kind == StorageNode::Kind::kMap) {
    const StorageNode* data = node.Find("data");
    if (data == nullptr) Fail(path, node, "a matrix without data");
    values = Numbers(path, *data);
    const StorageNode* rows = node.Find("rows");
    const StorageNode* columns = node.Find("cols");
    if (rows != nullptr && columns != nullptr) {
      const double count = Number(path, *rows) * Number(path, *columns);
      if (count != static_cast<double>(values.size())) {
        Fail(path, node, fmt::format("a matrix of {:g} values with {} given", count, values.size()));
      }
    }
  } else if (node.kind == StorageNode::Kind::kScalar) {
    values.push_back(Number(path, node));
  } else {
    for (const StorageNode& item : node.items) {
      const std::vector<double> more = Numbers(path, item);
      values.insert(values.end(), more.begin(), more.end());
    }
  }
  return values;
}

// Collects cameras by name.
class Collector {
 public:
  explicit Collector(bool fisheye) : fisheye_(fisheye) {}

  void AddFile(const StorageFile& file) { AddMap(file, file.root, "", true); }

  DistortedCameras Make() {
    std::erase_if(sources_, [](const auto& item) { return !item.second.fields.contains(Field::kK); });
    DistortedCameras cameras;
    for (const auto& [name, source] : sources_) cameras.push_back(MakeOne(name, source));
    return cameras;
  }

 private:
  // A map that has a K without an ending is one camera: `name`, else the file's.
  void AddMap(const StorageFile& file, const StorageNode& map, const std::string& name, bool is_root) {
    const bool is_one_camera = std::any_of(map.entries.begin(), map.entries.end(), [](const auto& entry) {
      const auto key = Classify(entry.key);
      return key && key->field == Field::kK && key->camera.empty();
    });
    for (const auto& [word, node] : map.entries) {
      const auto key = Classify(word);
      if (key) {
        std::string camera = key->camera;
        if (is_one_camera && camera.empty()) camera = name.empty() ? file.path.stem().string() : name;
        Source& source = camera.empty() ? shared_ : sources_[camera];
        if (source.path == nullptr) source.path = &file.path;
        if (!source.fields.emplace(key->field, &node).second && !camera.empty() && key->field == Field::kK) {
          Fail(file.path, node, fmt::format("camera '{}' is described twice", camera));
        }
      } else if (is_root && node.kind == StorageNode::Kind::kMap && node.Find("data") == nullptr) {
        AddMap(file, node, word, word == "cameras");
      } else if (is_root && node.kind == StorageNode::Kind::kList) {
        AddList(file, node);
      }
    }
  }

  // [{name: left, K: ...}, ...]
  void AddList(const StorageFile& file, const StorageNode& list) {
    for (const StorageNode& item : list.items) {
      const StorageNode* name = item.Find("name");
      if (name == nullptr) name = item.Find("camera_name");
      if (item.kind == StorageNode::Kind::kMap && name != nullptr) AddMap(file, item, name->scalar, false);
    }
  }

  // The camera's own value, else the one that all share.
  const StorageNode* Find(const Source& source, Field field) const {
    if (const auto it = source.fields.find(field); it != source.fields.end()) return it->second;
    if (const auto it = shared_.fields.find(field); it != shared_.fields.end()) return it->second;
    return nullptr;
  }

  std::vector<double> Values(const Source& source, const StorageNode& node, size_t count, const char* what) const {
    std::vector<double> values = Numbers(*source.path, node);
    if (values.size() != count) {
      Fail(*source.path, node, fmt::format("{} of {} numbers; expected {}", what, values.size(), count));
    }
    return values;
  }

  DistortedCamera MakeOne(const std::string& name, const Source& source) const {
    DistortedCamera made;
    if (!IsLayoutName(name)) throw FileError(*source.path, fmt::format("a camera cannot have the name '{}'", name));
    made.camera.name = name;
    const std::vector<double> k = Values(source, *Find(source, Field::kK), 9, "a camera matrix");
    made.camera.intrinsics = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(k.data());
    made.camera.intrinsics(0, 2) += 0.5;
    made.camera.intrinsics(1, 2) += 0.5;
    SetSize(source, &made.camera);
    SetLens(source, &made.lens);
    SetPose(name, source, &made.camera.cam_from_world);
    return made;
  }

  void SetSize(const Source& source, Camera* camera) const {
    const auto side = [&](const StorageNode& node, double value) {
      if (!(value >= 1 && value <= 32768)) Fail(*source.path, node, fmt::format("an image side of {:g} pixels", value));
      return static_cast<int>(value);
    };
    if (const StorageNode* size = Find(source, Field::kSize)) {
      const std::vector<double> both = Values(source, *size, 2, "an image size");
      camera->width = side(*size, both[0]);
      camera->height = side(*size, both[1]);
    }
    const StorageNode* width = Find(source, Field::kWidth);
    const StorageNode* height = Find(source, Field::kHeight);
    if (width != nullptr && height != nullptr) {
      camera->width = side(*width, Number(*source.path, *width));
      camera->height = side(*height, Number(*source.path, *height));
    }
  }

  void SetLens(const Source& source, Lens* lens) const {
    bool fisheye = fisheye_;
    if (const StorageNode* flag = Find(source, Field::kFisheye)) fisheye = Number(*source.path, *flag) != 0;
    if (const StorageNode* model = Find(source, Field::kModel)) {
      fisheye = model->scalar == "fisheye" || model->scalar == "equidistant";
      const bool known = fisheye || model->scalar == "plumb_bob" || model->scalar == "rational_polynomial" ||
                         model->scalar == "radtan" || model->scalar == "opencv";
      if (!known) Fail(*source.path, *model, fmt::format("the distortion model '{}' is not known here", model->scalar));
    }
    lens->model = fisheye ? Lens::Model::kFisheye : Lens::Model::kRadialTangential;
    const StorageNode* node = Find(source, Field::kD);
    if (node == nullptr) return;
    const std::vector<double> d = Numbers(*source.path, *node);
    const std::array<size_t, 6> counts = {0, 4, 5, 8, 12, 14};
    if (fisheye ? d.size() != 4 : std::find(counts.begin(), counts.end(), d.size()) == counts.end()) {
      Fail(*source.path, *node,
           fmt::format("{} distortion coefficients; expected {}", d.size(), fisheye ? "4 of a fisheye" : "4, 5 or 8"));
    }
    for (size_t i = 8; i < d.size(); ++i) {
      if (d[i] != 0) Fail(*source.path, *node, "thin-prism or tilted-sensor distortion, which is not known here");
    }
    std::copy_n(d.begin(), std::min<size_t>(8, d.size()), lens->k.begin());
  }

  // A stereo pair's R and T have no ending: they are those of camera 2, and the world is camera 1.
  void SetPose(const std::string& name, const Source& source, RigidTransform* pose) const {
    const auto own = [&](Field field) {
      const auto it = source.fields.find(field);
      return it == source.fields.end() ? nullptr : it->second;
    };
    const StorageNode* rotation = own(Field::kR);
    const StorageNode* translation = own(Field::kT);
    if (translation == nullptr) {
      const bool is_pair = sources_.size() == 2 && sources_.contains("1") && sources_.contains("2");
      if (is_pair && name == "1") return;
      rotation = Find(shared_, Field::kR);
      translation = Find(shared_, Field::kT);
      if (!is_pair || rotation == nullptr || translation == nullptr) {
        throw FileError(*source.path, fmt::format("camera '{}' has no pose; expected R and T, or rvec and tvec", name));
      }
    }
    if (rotation == nullptr) throw FileError(*source.path, fmt::format("camera '{}' has T but no R", name));
    const std::vector<double> r = Numbers(*source.path, *rotation);
    if (r.size() == 9) {
      pose->rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data());
    } else if (r.size() == 3) {
      const Eigen::Vector3d axis(r[0], r[1], r[2]);
      if (axis.norm() > 0) pose->rotation = Eigen::AngleAxisd(axis.norm(), axis.normalized()).toRotationMatrix();
    } else {
      Fail(*source.path, *rotation, fmt::format("a rotation of {} numbers; expected 9 or 3", r.size()));
    }
    const std::vector<double> t = Values(source, *translation, 3, "a translation");
    pose->translation = {t[0], t[1], t[2]};
  }

  const bool fisheye_;
  std::map<std::string, Source> sources_;
  Source shared_;
};

}  // namespace

DistortedCameras CamerasFromStorage(const std::vector<StorageFile>& files, bool fisheye) {
  LIKENESS_CHECK(!files.empty());
  Collector collector(fisheye);
  for (const StorageFile& file : files) collector.AddFile(file);
  DistortedCameras cameras = collector.Make();
  const std::filesystem::path& path = files.size() == 1 ? files[0].path : files[0].path.parent_path();
  if (cameras.empty()) throw FileError(path, "describes no cameras: found no camera_matrix, K or M (K1, K_left, ...)");
  CheckCameras(path, cameras);
  return cameras;
}

}  // namespace likeness
