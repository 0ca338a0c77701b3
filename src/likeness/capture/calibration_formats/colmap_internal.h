// What COLMAP's text and binary models share.

#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string_view>

#include "likeness/capture/calibration_formats/colmap.h"

namespace likeness::colmap {

// COLMAP's number, name and count of parameters of a camera model.
struct Model {
  int id = 0;
  const char* name = "";
  size_t parameters = 0;
  bool is_known = false;  // can be read here
};

inline constexpr int kPinholeId = 1;

// Throw Error naming the model when it is not known or not read here.
const Model& FindModel(const std::filesystem::path& path, std::string_view name);
const Model& FindModel(const std::filesystem::path& path, int64_t id);

// K, size and lens from a model's parameters.
DistortedCamera MakeCamera(const std::filesystem::path& path, const Model& model, uint64_t width, uint64_t height,
                           std::span<const double> parameters);

// The camera with an image's pose (quaternion w x y z, translation) and name.
DistortedCamera MakeImage(const std::filesystem::path& path, const std::map<uint32_t, DistortedCamera>& cameras,
                          uint32_t camera_id, std::span<const double, 7> pose, std::string_view name);

// fx fy cx cy, and w x y z tx ty tz.
std::array<double, 4> PinholeParameters(const DistortedCamera& camera);
std::array<double, 7> Pose(const DistortedCamera& camera);

}  // namespace likeness::colmap
