#include "likeness/simulate/material_maps.h"

#include <algorithm>
#include <cmath>

#include "likeness/image/srgb.h"

namespace likeness {
namespace {

constexpr float kMost = 65535;

uint16_t Quantised(float value) { return static_cast<uint16_t>(std::lround(kMost * std::clamp(value, 0.0f, 1.0f))); }

// The four texels around a texture coordinate and their weights.
struct Footprint {
  size_t at[4];
  float weights[4];

  Footprint(const Eigen::Vector2f& uv, int width, int height) {
    const float x = std::clamp(uv.x(), 0.0f, 1.0f) * static_cast<float>(width) - 0.5f;
    const float y = (1 - std::clamp(uv.y(), 0.0f, 1.0f)) * static_cast<float>(height) - 0.5f;
    // x and y are above -1, so that truncation of one more is a floor.
    const int left = static_cast<int>(x + 1) - 1, top = static_cast<int>(y + 1) - 1;
    const float fx = x - static_cast<float>(left), fy = y - static_cast<float>(top);
    const int x0 = std::max(left, 0), x1 = std::min(left + 1, width - 1);
    const size_t row0 = static_cast<size_t>(std::max(top, 0)) * static_cast<size_t>(width);
    const size_t row1 = static_cast<size_t>(std::min(top + 1, height - 1)) * static_cast<size_t>(width);
    at[0] = row0 + x0;
    at[1] = row0 + x1;
    at[2] = row1 + x0;
    at[3] = row1 + x1;
    weights[0] = (1 - fy) * (1 - fx);
    weights[1] = (1 - fy) * fx;
    weights[2] = fy * (1 - fx);
    weights[3] = fy * fx;
  }
};

}  // namespace

MaterialMaps::Sheet* MaterialMaps::SheetOf(int width, int height) {
  for (Sheet& sheet : sheets_) {
    if (sheet.width == width && sheet.height == height) return &sheet;
  }
  const size_t texels = static_cast<size_t>(width) * static_cast<size_t>(height);
  return &sheets_.emplace_back(Sheet{width, height, std::vector<Texel>(texels, Texel{})});
}

MaterialMaps::MaterialMaps(const Material& material, bool linear) {
  // Copies channels first ... of a map into lanes; `encode` turns a value into one in 0 ... 1.
  const auto fill = [&](const auto& map, int lane, int channels, int first, const auto& encode) {
    Sheet* sheet = SheetOf(map.width(), map.height());
    const auto* value = map.values().data();
    for (Texel& texel : sheet->texels) {
      // Grey stands for all colours.
      for (int c = 0; c < channels; ++c) texel[lane + c] = encode(value[map.channels() < 3 ? 0 : first + c]);
      value += map.channels();
    }
    for (int c = 0; c < channels; ++c) scale_[lane + c] = 1 / kMost;
  };
  for (const int lane : {kAlbedo + 0, kAlbedo + 1, kAlbedo + 2, kCoverage + 0, kNormal + 2}) offset_[lane] = 1;
  offset_[kRoughness] = material.roughness;
  offset_[kSpecular] = 1;
  if (!material.albedo.empty()) {
    std::array<uint16_t, 256> decode;
    for (int i = 0; i < 256; ++i) {
      const float value = static_cast<float>(i) / 255;
      decode[static_cast<size_t>(i)] = Quantised(linear ? LinearFromSrgb(value) : value);
    }
    fill(material.albedo, kAlbedo, 3, 0, [&](uint8_t v) { return decode[v]; });
    for (int c = 0; c < 3; ++c) offset_[kAlbedo + c] = 0;
    if (material.albedo.channels() == 4) {
      fill(material.albedo, kCoverage, 1, 3, [](uint8_t v) { return static_cast<uint16_t>(257 * v); });
      offset_[kCoverage] = 0;
    }
  }
  if (!material.normal_map.empty()) {
    has_normals_ = true;
    fill(material.normal_map, kNormal, 3, 0, [](float v) { return Quantised(0.5f + 0.5f * v); });
    for (int c = 0; c < 3; ++c) scale_[kNormal + c] = 2 / kMost, offset_[kNormal + c] = -1;
  }
  const auto fill_scalar = [&](const ImageF& map, int lane) {
    if (map.empty()) return;
    // Specular maps may say more than 1.
    const float most = std::max(1.0f, *std::max_element(map.values().begin(), map.values().end()));
    fill(map, lane, 1, 0, [&](float v) { return Quantised(v / most); });
    scale_[lane] = most / kMost;
    offset_[lane] = 0;
  };
  fill_scalar(material.roughness_map, kRoughness);
  fill_scalar(material.specular_map, kSpecular);
}

SurfaceSample MaterialMaps::Sample(const Eigen::Vector2f& uv) const {
  alignas(64) float sums[kLanes] = {};
  for (const Sheet& sheet : sheets_) {
    const Footprint footprint(uv, sheet.width, sheet.height);
    const uint16_t* texels[4];
    for (int k = 0; k < 4; ++k) texels[k] = sheet.texels[footprint.at[k]].data();
    for (int i = 0; i < kLanes; ++i) {
      sums[i] += footprint.weights[0] * static_cast<float>(texels[0][i]) +
                 footprint.weights[1] * static_cast<float>(texels[1][i]) +
                 footprint.weights[2] * static_cast<float>(texels[2][i]) +
                 footprint.weights[3] * static_cast<float>(texels[3][i]);
    }
  }
  for (int i = 0; i < kLanes; ++i) sums[i] = sums[i] * scale_[i] + offset_[i];
  return {{sums[kAlbedo], sums[kAlbedo + 1], sums[kAlbedo + 2]},
          sums[kCoverage],
          {sums[kNormal], sums[kNormal + 1], sums[kNormal + 2]},
          sums[kRoughness],
          sums[kSpecular]};
}

void MaterialMaps::Prefetch(const Eigen::Vector2f& uv) const {
  for (const Sheet& sheet : sheets_) {
    const Footprint footprint(uv, sheet.width, sheet.height);
    for (const size_t at : footprint.at) __builtin_prefetch(sheet.texels.data() + at);
  }
}

float MaterialMaps::Coverage(const Eigen::Vector2f& uv) const {
  if (scale_[kCoverage] == 0) return offset_[kCoverage];
  float sum = 0;
  for (const Sheet& sheet : sheets_) {
    const Footprint footprint(uv, sheet.width, sheet.height);
    float blended = 0;
    for (int k = 0; k < 4; ++k) {
      blended += footprint.weights[k] * static_cast<float>(sheet.texels[footprint.at[k]][kCoverage]);
    }
    sum += blended;
  }
  return sum * scale_[kCoverage] + offset_[kCoverage];
}

}  // namespace likeness
