#include "likeness/simulate/glb/glb_material.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "likeness/image/image_io.h"
#include "likeness/image/srgb.h"

namespace likeness {
namespace {

uint8_t Encode(float linear) {
  return static_cast<uint8_t>(std::lround(255 * SrgbFromLinear(std::clamp(linear, 0.0f, 1.0f))));
}

ImageU8 Decode(const std::filesystem::path& path, const GltfScene& scene, int image, int channels) {
  return DecodeImage(fmt::format("{}: image {}", path.string(), image), scene.images[image], channels);
}

ImageU8 Albedo(const std::filesystem::path& path, const GltfScene& scene, const GltfMaterial& material) {
  const bool has_alpha = material.alpha != GltfAlpha::kOpaque;
  ImageU8 image = material.base_image >= 0 ? Decode(path, scene, material.base_image, has_alpha ? 4 : 3)
                                           : ImageU8(1, 1, has_alpha ? 4 : 3, 255);
  std::array<std::array<uint8_t, 256>, 3> tint;
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < 256; ++i) {
      tint[c][i] = Encode(material.base_colour[c] * LinearFromSrgb(static_cast<float>(i) / 255));
    }
  }
  bool is_clear = false;  // anywhere
  const int channels = image.channels();
  const std::span<uint8_t> values = image.values();
  for (size_t i = 0; i < values.size(); i += channels) {
    for (int c = 0; c < 3; ++c) values[i + c] = tint[c][values[i + c]];
    if (!has_alpha) continue;
    const float alpha = material.base_colour[3] * static_cast<float>(values[i + 3]) / 255;
    values[i + 3] = material.alpha == GltfAlpha::kMask ? (alpha >= material.alpha_cutoff ? 255 : 0)
                                                       : static_cast<uint8_t>(std::lround(255 * alpha));
    is_clear |= values[i + 3] < 250;
  }
  if (!has_alpha || is_clear) return image;
  // Nothing shows through: an opaque surface casts shadows.
  ImageU8 opaque(image.width(), image.height(), 3);
  for (size_t i = 0; i < values.size() / 4; ++i) std::copy_n(&values[4 * i], 3, &opaque.values()[3 * i]);
  return opaque;
}

ImageF NormalMap(const ImageU8& image, float scale) {
  ImageF map(image.width(), image.height(), 3);
  for (size_t i = 0; i < map.values().size(); i += 3) {
    const uint8_t* p = &image.values()[i];
    const auto decode = [](uint8_t value) { return static_cast<float>(value) / 127.5f - 1; };
    Eigen::Vector3f normal(scale * decode(p[0]), scale * decode(p[1]), std::max(decode(p[2]), 0.05f));
    normal.normalize();
    std::copy_n(normal.data(), 3, &map.values()[i]);
  }
  return map;
}

ImageF RoughnessMap(const ImageU8& image, float factor) {
  ImageF map(image.width(), image.height(), 1);
  for (size_t i = 0; i < map.values().size(); ++i) {
    map.values()[i] = std::clamp(factor * static_cast<float>(image.values()[3 * i + 1]) / 255, 0.05f, 1.0f);
  }
  return map;
}

// Where hair is painted or modelled on the skin: texels much darker than the most. They shine less.
//   returns  scale of the specular lobe
ImageF DimHair(const ImageU8& albedo) {
  std::array<int, 256> histogram = {};
  const auto brightness = [&](size_t i) { return albedo.values()[i + 1]; };  // green: of hair and skin much the same
  for (size_t i = 0; i < albedo.values().size(); i += 3) ++histogram[brightness(i)];
  // Hair and clothes may be more than half of the texels: the brightness that three in four do not reach.
  int below = 0, bright = 0;
  const auto texels = static_cast<int>(albedo.values().size() / 3);
  while (bright < 255 && (below += histogram[bright]) < texels * 3 / 4) ++bright;
  ImageF scale(albedo.width(), albedo.height(), 1);
  for (size_t i = 0; i < scale.values().size(); ++i) {
    constexpr float kHair = 0.45f, kSkin = 0.7f, kLeast = 0.25f;
    const float relative = static_cast<float>(brightness(3 * i)) / static_cast<float>(std::max(bright, 1));
    const float t = std::clamp((relative - kHair) / (kSkin - kHair), 0.0f, 1.0f);
    scale.values()[i] = kLeast + (1 - kLeast) * t;
  }
  return scale;
}

// Textures of teeth are often painted yellow, as teeth look between lips in warm light. Lit, they turn green-grey: what
// is no gum or tongue is brought near ivory.
void WhitenTeeth(ImageU8* albedo) {
  const int channels = albedo->channels();
  for (size_t i = 0; i < albedo->values().size(); i += channels) {
    uint8_t* p = &albedo->values()[i];
    const float red = LinearFromSrgb(p[0] / 255.0f), green = LinearFromSrgb(p[1] / 255.0f);
    const float blue = LinearFromSrgb(p[2] / 255.0f);
    const float tooth = std::clamp((green - 0.62f * red) / (0.16f * red + 1e-4f), 0.0f, 1.0f);
    const float light = std::max({red, green, blue});
    p[1] = Encode(green + tooth * (0.88f * light - green));
    p[2] = Encode(blue + tooth * (0.72f * light - blue));
    p[0] = Encode(red + tooth * (light - red));
  }
}

void SetKind(PartKind kind, Material* material) {
  switch (kind) {
    case PartKind::kSkin:
      material->roughness = 0.5f;
      material->specular_f0 = 0.035f;
      material->scatter = {0.32f, 0.15f, 0.09f};
      break;
    case PartKind::kEye:
      material->roughness = 0.45f;
      material->specular_f0 = 0.02f;
      material->scatter = {0.25f, 0.2f, 0.18f};
      material->coat = 0.5f;
      material->coat_roughness = 0.05f;
      break;
    case PartKind::kTear:
      material->roughness = 0.4f;
      material->scatter = {0.35f, 0.2f, 0.15f};
      material->coat = 0.6f;
      material->coat_roughness = 0.1f;
      material->casts_shadow = false;
      break;
    case PartKind::kMouth:
      material->roughness = 0.4f;
      material->specular_f0 = 0.04f;
      material->scatter = {0.22f, 0.18f, 0.15f};
      material->coat = 0.4f;
      material->coat_roughness = 0.25f;
      break;
    case PartKind::kHair:
      material->roughness = 0.6f;
      material->specular_f0 = 0.025f;
      material->scatter = {0.3f, 0.25f, 0.2f};
      break;
    case PartKind::kLashes:
      material->roughness = 0.5f;
      material->specular_f0 = 0.02f;
      material->casts_shadow = false;
      break;
    case PartKind::kClothes:
      material->roughness = 0.8f;
      material->specular_f0 = 0.03f;
      break;
  }
}

}  // namespace

Material MakeMaterial(const std::filesystem::path& path_for_errors, const GltfScene& scene, int material,
                      PartKind kind) {
  Material result;
  SetKind(kind, &result);
  if (material < 0) {
    result.albedo = ImageU8(1, 1, 3, 150);
    return result;
  }
  const GltfMaterial& source = scene.materials[material];
  result.albedo = Albedo(path_for_errors, scene, source);
  if (source.normal_image >= 0) {
    result.normal_map = NormalMap(Decode(path_for_errors, scene, source.normal_image, 3), source.normal_scale);
  }
  if (source.rough_metal_image >= 0) {
    result.roughness_map = RoughnessMap(Decode(path_for_errors, scene, source.rough_metal_image, 3), source.roughness);
  }
  if (kind == PartKind::kMouth) WhitenTeeth(&result.albedo);
  if (kind == PartKind::kSkin && result.albedo.channels() == 3) result.specular_map = DimHair(result.albedo);
  // A clear shell over the eye shows by its highlights alone.
  if (kind == PartKind::kEye && result.albedo.channels() == 4) {
    result.transparent = true;
    result.casts_shadow = false;
  }
  return result;
}

}  // namespace likeness
