#include "likeness/avatar/performance.h"

#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/json.h"

namespace likeness {

namespace {

constexpr char kFormat[] = "likeness-performance";
constexpr char kVersion[] = "1";
constexpr double kRotationTolerance = 1e-3;  // of what other programs write in single precision
constexpr size_t kPoseValues = 12;           // 3 x 4, row by row

int64_t ValueCount(const std::vector<NamedCondition>& conditions) {
  int64_t count = 0;
  for (const NamedCondition& condition : conditions) count += condition.size;
  return count;
}

std::span<const float> Row(const std::vector<float>& values, int64_t row, int64_t width) {
  return std::span(values).subspan(static_cast<size_t>(row * width), static_cast<size_t>(width));
}

std::vector<float> Mix(std::span<const float> a, std::span<const float> b, float share_of_b) {
  std::vector<float> mixed(a.size());
  for (size_t i = 0; i < a.size(); ++i) mixed[i] = a[i] + share_of_b * (b[i] - a[i]);
  return mixed;
}

std::string ConditionsText(const std::vector<NamedCondition>& conditions) {
  nlohmann::json list = nlohmann::json::array();
  for (const NamedCondition& condition : conditions) list.push_back({condition.name, condition.size});
  return list.dump();
}

void CheckFinite(const std::string& what, const char* name, std::span<const float> values) {
  if (!std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); })) {
    throw Error("{}: {} hold values that are not finite", what, name);
  }
}

void CheckCount(const std::string& what, const char* name, size_t count, size_t expected) {
  if (count != expected) throw Error("{}: there are {} {}; expected {}", what, count, name, expected);
}

void CheckConditions(const std::string& what, const std::vector<NamedCondition>& conditions) {
  constexpr int kMostValues = 4096;
  for (const NamedCondition& condition : conditions) {
    if (!IsConditionName(condition.name) || condition.size < 1 || condition.size > kMostValues) {
      throw Error("{}: '{}' of {} values is no condition; expected letters, digits, '-' and '_', and 1 to {} values",
                  what, condition.name, condition.size, kMostValues);
    }
  }
}

// Everything of a file, in the order in which it stands there.
struct Tensors {
  std::vector<double> poses;  // [F, 3, 4]
  std::vector<TensorView> views;
  std::map<std::string, std::string> metadata;

  explicit Tensors(const Performance& p) {
    for (const RigidTransform& pose : p.world_from_head) {
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) poses.push_back(pose.rotation(row, column));
        poses.push_back(pose.translation[row]);
      }
    }
    const int64_t frames = p.frame_count(), values = ValueCount(p.conditions);
    views.push_back({"seconds", DType::kF64, {frames}, std::as_bytes(std::span(p.seconds))});
    views.push_back({"world_from_head", DType::kF64, {frames, 3, 4}, std::as_bytes(std::span(poses))});
    views.push_back(ViewOf("codes", {frames, p.latent}, p.codes));
    if (values > 0) views.push_back(ViewOf("conditions", {frames, values}, p.condition_values));
    metadata = {{"format", kFormat},
                {"version", kVersion},
                {"avatar", p.avatar},
                {"person", p.person},
                {"conditions", ConditionsText(p.conditions)},
                {"frames", nlohmann::json(p.frame_names).dump()},
                {"units", "seconds from 0; millimetres; world_from_head takes points of head space to world space"}};
  }
};

// The values of an F64 tensor; -1 in `shape` matches any extent.
std::vector<double> ReadDoubles(const SafetensorsFile& file, const std::string& name,
                                const std::vector<int64_t>& shape) {
  const std::vector<int64_t>& found = file.ShapeOf(name);
  const bool fits = std::equal(found.begin(), found.end(), shape.begin(), shape.end(),
                               [](int64_t is, int64_t wanted) { return wanted < 0 || is == wanted; });
  if (file.DTypeOf(name) != DType::kF64 || !fits) {
    throw FileError(file.path(),
                    fmt::format("tensor '{}' is {} [{}]; expected F64 [{}]", name, ToString(file.DTypeOf(name)),
                                fmt::join(found, ", "), fmt::join(shape, ", ")));
  }
  const std::span<const std::byte> bytes = file.Bytes(name);
  std::vector<double> values(bytes.size() / sizeof(double));
  std::copy(bytes.begin(), bytes.end(), std::as_writable_bytes(std::span(values)).begin());
  return values;
}

template <typename T>
T ReadList(const SafetensorsFile& file, const char* key) {
  if (!file.metadata().contains(key)) return {};
  const std::string where = fmt::format("{}: metadata '{}'", file.path().string(), key);
  try {
    return ParseJson(where, file.Metadata(key)).get<T>();
  } catch (const nlohmann::json::exception& error) {
    throw FileError(where, fmt::format("is not understood: {}", error.what()));
  }
}

std::string OptionalText(const SafetensorsFile& file, const char* key) {
  const auto found = file.metadata().find(key);
  return found == file.metadata().end() ? "" : found->second;
}

Performance PerformanceFrom(const SafetensorsFile& file) {
  if (!IsPerformance(file)) {
    throw FileError(file.path(),
                    "is no performance (its metadata lack format = likeness-performance); likeness encode makes one");
  }
  if (const std::string& version = file.Metadata("version"); version != kVersion) {
    throw FileError(file.path(),
                    fmt::format("is a performance of version '{}'; this program reads version {}", version, kVersion));
  }
  Performance p;
  p.avatar = OptionalText(file, "avatar");
  p.person = OptionalText(file, "person");
  for (const auto& [name, size] : ReadList<std::vector<std::pair<std::string, int>>>(file, "conditions")) {
    p.conditions.push_back({name, size});
  }
  CheckConditions(file.path().string(), p.conditions);
  p.frame_names = ReadList<std::vector<std::string>>(file, "frames");
  p.seconds = ReadDoubles(file, "seconds", {-1});
  const int64_t frames = p.frame_count(), values = ValueCount(p.conditions);
  p.codes = file.Floats("codes", {frames, -1});
  p.latent = static_cast<int>(std::min<int64_t>(file.ShapeOf("codes")[1], std::numeric_limits<int>::max()));
  if (values > 0) p.condition_values = file.Floats("conditions", {frames, values});
  const std::vector<double> poses = ReadDoubles(file, "world_from_head", {frames, 3, 4});
  for (size_t i = 0; i < poses.size(); i += kPoseValues) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> pose(&poses[i]);
    p.world_from_head.push_back({pose.leftCols<3>(), pose.col(3)});
  }
  p.Check(file.path().string());
  return p;
}

}  // namespace

std::span<const float> Performance::Code(int frame) const { return Row(codes, frame, latent); }

std::span<const float> Performance::ConditionValues(int frame) const {
  return Row(condition_values, frame, ValueCount(conditions));
}

void Performance::Check(const std::string& what) const {
  CheckConditions(what, conditions);
  const size_t frames = seconds.size();
  if (frames == 0) throw Error("{}: a performance has at least one frame", what);
  if (latent < 1) throw Error("{}: codes have at least one value, not {}", what, latent);
  CheckCount(what, "values of codes", codes.size(), frames * static_cast<size_t>(latent));
  CheckCount(what, "values of conditions", condition_values.size(),
             frames * static_cast<size_t>(ValueCount(conditions)));
  CheckCount(what, "head poses", world_from_head.size(), frames);
  if (!frame_names.empty()) CheckCount(what, "frame names", frame_names.size(), frames);
  CheckFinite(what, "codes", codes);
  CheckFinite(what, "conditions", condition_values);
  for (size_t i = 0; i < frames; ++i) {
    if (!std::isfinite(seconds[i]) || (i == 0 ? seconds[i] != 0 : !(seconds[i] > seconds[i - 1]))) {
      throw Error("{}: frame {} is at {} s; time must begin at 0 and rise from frame to frame", what, i, seconds[i]);
    }
    const RigidTransform& pose = world_from_head[i];
    // Written so that a value that is no number fails, too.
    if (!(RotationDefect(pose.rotation) <= kRotationTolerance) || !pose.translation.allFinite()) {
      throw Error("{}: the head pose of frame {} is no rotation and translation", what, i);
    }
  }
}

bool IsPerformance(const SafetensorsFile& file) { return OptionalText(file, "format") == kFormat; }

PerformanceMoment MomentAt(const Performance& p, double seconds) {
  const auto next = std::upper_bound(p.seconds.begin(), p.seconds.end(), seconds);
  const int b = std::min(static_cast<int>(next - p.seconds.begin()), p.frame_count() - 1);
  const int a = std::max(0, static_cast<int>(next - p.seconds.begin()) - 1);
  const double share = a == b ? 0 : (seconds - p.seconds[a]) / (p.seconds[b] - p.seconds[a]);
  const RigidTransform &from = p.world_from_head[a], &to = p.world_from_head[b];
  PerformanceMoment moment;
  moment.code = Mix(p.Code(a), p.Code(b), static_cast<float>(share));
  moment.condition_values = Mix(p.ConditionValues(a), p.ConditionValues(b), static_cast<float>(share));
  moment.world_from_head = {Eigen::Quaterniond(from.rotation)
                                .normalized()
                                .slerp(share, Eigen::Quaterniond(to.rotation).normalized())
                                .toRotationMatrix(),
                            from.translation + share * (to.translation - from.translation)};
  return moment;
}

void CheckBelongs(const Performance& performance, const std::filesystem::path& path_for_errors,
                  const Architecture& architecture, const std::string& avatar_id) {
  if (performance.latent != architecture.latent) {
    throw FileError(path_for_errors, fmt::format("has codes of {} values; this avatar's have {}", performance.latent,
                                                 architecture.latent));
  }
  if (!performance.conditions.empty() && performance.conditions != architecture.conditions) {
    throw FileError(path_for_errors,
                    fmt::format("has the conditions {}; this avatar's are {}", ConditionsText(performance.conditions),
                                ConditionsText(architecture.conditions)));
  }
  if (!performance.avatar.empty() && !avatar_id.empty() && performance.avatar != avatar_id) {
    throw FileError(
        path_for_errors,
        fmt::format("holds codes of the avatar {}, and this is the avatar {}; codes mean nothing to another "
                    "avatar: make the performance again with likeness encode or likeness drive",
                    performance.avatar, avatar_id));
  }
}

std::string PerformanceBytes(const Performance& performance) {
  const Tensors tensors(performance);
  std::string bytes = SafetensorsHeader(tensors.views, tensors.metadata);
  for (const TensorView& view : tensors.views) {
    bytes.append(reinterpret_cast<const char*>(view.bytes.data()), view.bytes.size());
  }
  return bytes;
}

void WritePerformance(const std::filesystem::path& path, const Performance& performance) {
  performance.Check(path.string());
  WriteFile(path, PerformanceBytes(performance));
}

Performance ReadPerformance(const std::filesystem::path& path) { return PerformanceFrom(SafetensorsFile(path)); }

Performance ParsePerformance(const std::filesystem::path& path_for_errors, std::string bytes) {
  return PerformanceFrom(SafetensorsFile(path_for_errors, std::move(bytes)));
}

}  // namespace likeness
