#include "likeness/train/evaluation_part_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "likeness/base/error.h"
#include "likeness/base/json.h"

namespace likeness {
namespace {

// JSON has no word for numbers that are not finite.
double Number(const nlohmann::json& value) {
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

// A whole number below `most`; `most` itself stands for all others, which no file of ours has.
int64_t Count(const nlohmann::json& value, int64_t most) {
  if (!value.is_number_unsigned()) return most;
  return static_cast<int64_t>(std::min(value.get<uint64_t>(), static_cast<uint64_t>(most)));
}

SquaredError Squares(const nlohmann::json& pair, int64_t most) { return {Number(pair.at(0)), Count(pair.at(1), most)}; }

}  // namespace

std::string PartText(const PartMeasurements& measurements) {
  nlohmann::ordered_json images = nlohmann::ordered_json::array();
  for (size_t i = 0; i < measurements.size(); ++i) {
    if (!measurements[i]) continue;
    const ImageMeasurement& m = *measurements[i];
    images.push_back({{"image", i},
                      {"squares", {m.error.sum, m.error.count}},
                      {"covered_squares", {m.covered.sum, m.covered.count}},
                      {"texture_squares", {m.texture.sum, m.texture.count}},
                      {"ssim", m.ssim},
                      {"vertex_mm", m.vertex_mm},
                      {"head_pixels", m.head_pixels},
                      {"uncovered_pixels", m.uncovered_pixels},
                      {"unmasked", m.unmasked}});
  }
  return nlohmann::ordered_json({{"images_in_all", measurements.size()}, {"images", images}}).dump() + '\n';
}

PartMeasurements ParsePart(const std::filesystem::path& path_for_errors, std::string_view text, size_t images) {
  constexpr int64_t kMost = int64_t{1} << 40;
  PartMeasurements measurements(images);
  try {
    const nlohmann::json root = ParseJson(path_for_errors, text);
    const auto count = static_cast<int64_t>(images);
    if (Count(root.at("images_in_all"), count + 1) != count) {
      throw FileError(path_for_errors, fmt::format("is not of this evaluation of {} images; remove it", images));
    }
    for (const nlohmann::json& image : root.at("images")) {
      ImageMeasurement m;
      m.error = Squares(image.at("squares"), kMost);
      m.covered = Squares(image.at("covered_squares"), kMost);
      m.texture = Squares(image.at("texture_squares"), kMost);
      m.ssim = Number(image.at("ssim"));
      m.vertex_mm = Number(image.at("vertex_mm"));
      m.head_pixels = Count(image.at("head_pixels"), kMost);
      m.uncovered_pixels = Count(image.at("uncovered_pixels"), kMost);
      m.unmasked = image.at("unmasked").get<bool>();
      const int64_t index = Count(image.at("image"), count);
      if (index == count ||
          std::max({m.error.count, m.covered.count, m.texture.count, m.head_pixels, m.uncovered_pixels}) == kMost) {
        throw FileError(path_for_errors, "has numbers that this evaluation cannot have; remove it");
      }
      measurements[static_cast<size_t>(index)] = m;
    }
  } catch (const nlohmann::json::exception& error) {
    throw FileError(path_for_errors, fmt::format("is no part of an evaluation, remove it: {}", error.what()));
  }
  return measurements;
}

}  // namespace likeness
