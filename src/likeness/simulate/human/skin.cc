#include "likeness/simulate/human/skin.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "likeness/base/parallel.h"
#include "likeness/base/random.h"
#include "likeness/image/image_io.h"
#include "likeness/simulate/human/brows.h"
#include "likeness/simulate/human/noise.h"
#include "likeness/simulate/human/pigment.h"
#include "likeness/simulate/human/skin_regions.h"

namespace likeness {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

float SampleMask(const ImageU8& mask, const Vector2f& uv) {
  const int x = std::clamp(static_cast<int>(uv.x() * static_cast<float>(mask.width())), 0, mask.width() - 1);
  const int y = std::clamp(static_cast<int>((1 - uv.y()) * static_cast<float>(mask.height())), 0, mask.height() - 1);
  return static_cast<float>(*mask.at(x, y)) / 255;
}

// One texel's place on the head.
struct Spot {
  Vector3f point;    // of the person
  Vector3f average;  // of the average head
  Vector2f makehuman_uv;
  float texel_mm = 1;  // side of the texel on the skin
  bool in_mouth = false;
};

// What the painter puts there.
struct Paint {
  Vector3f albedo = Vector3f::Zero();  // linear
  float height = 0;                    // mm
  float roughness = 0.5f;
  float specular = 1;
};

class SkinPainter {
 public:
  SkinPainter(const SkinSheet& sheet, const SkinMasks& masks, const HumanRecipe& recipe);
  Paint At(const Spot& spot) const;

 private:
  struct Mole {
    Vector3f point;
    float radius, strength;
  };
  Paint InMouth(const Spot& spot) const;
  float Relief(const Spot& spot, float lips) const;

  const SkinSheet& sheet_;
  const SkinMasks& masks_;
  const HumanRecipe& recipe_;
  const uint32_t seed_;
  const BrowDrawing brows_;
  const Vector3f hair_;
  std::vector<Mole> moles_;
};

SkinPainter::SkinPainter(const SkinSheet& sheet, const SkinMasks& masks, const HumanRecipe& recipe)
    : sheet_(sheet),
      masks_(masks),
      recipe_(recipe),
      seed_(static_cast<uint32_t>(Hash({recipe.seed, 17}))),
      brows_(recipe),
      hair_(HairColour(static_cast<float>(recipe.hair_melanin), static_cast<float>(recipe.hair_redness),
                       static_cast<float>(recipe.grey))) {
  Random random(Hash({recipe.seed, 41}));
  const int count = static_cast<int>(12 * recipe.moles);
  for (int i = 0; i < count; ++i) {
    // Evenly over the directions from the head's centre.
    const Vector3f direction(static_cast<float>(random.Normal()), static_cast<float>(random.Normal()),
                             static_cast<float>(random.Normal()));
    const Eigen::VectorXf along = (sheet.points.rowwise().normalized() * direction).eval();
    Eigen::Index nearest = 0;
    along.maxCoeff(&nearest);
    const auto radius = static_cast<float>(random.Uniform(0.4, 1.2));
    moles_.push_back({sheet.points.row(nearest), radius, static_cast<float>(random.Uniform(0.12, 0.5))});
  }
}

Paint SkinPainter::InMouth(const Spot& spot) const {
  Paint paint;
  const float veins = FractalNoise(spot.point / 5, 3, seed_ + 60);
  // Dark towards the throat, where little light gets.
  const float depth = SmoothStep(18, -35, spot.average.z());
  paint.albedo = Vector3f(0.50f, 0.20f, 0.17f) * (1 + 0.12f * veins) * (1 - 0.75f * depth);
  paint.height = 0.12f * FractalNoise(spot.point / 2.5f, 2, seed_ + 61);
  paint.roughness = 0.3f;
  return paint;
}

// Pores, fine lines and lip creases, mm. What is finer than the texels fades out.
float SkinPainter::Relief(const Spot& spot, float lips) const {
  const auto resolved = [&](float size) { return std::clamp(size / (2 * spot.texel_mm) - 0.2f, 0.0f, 1.0f); };
  const float face = FaceWeight(spot.average);
  const float skin = 1 - lips;
  float height = 0;
  if (const float fade = resolved(1.0f) * skin; fade > 0) {
    const NearestSpot pore = FindNearestSpot(spot.point / 1.15f, seed_ + 50);
    const float size = 0.22f + 0.16f * UnitFromBits(pore.id);
    const float where = (0.35f + 0.65f * std::max(TZoneWeight(spot.average), CheekWeight(spot.average))) * face;
    height -= 0.10f * where * fade * SmoothStep(size, 0, pore.distance);
  }
  // The net of fine furrows between pores.
  if (const float fade = resolved(0.7f) * skin; fade > 0) {
    height += 0.045f * fade * FractalNoise(spot.point / 0.8f, 2, seed_ + 51);
  }
  height += 0.08f * skin * resolved(2) * FractalNoise(spot.point / 2.6f, 2, seed_ + 52);
  height += 0.10f * skin * FractalNoise(spot.point / 9, 2, seed_ + 53);
  if (face > 0) {
    height += static_cast<float>(0.15 + 1.1 * recipe_.age) * skin * resolved(1.2f) * WrinkleHeight(spot.average);
  }
  if (lips > 0) {
    // Creases across the lips, fanning out from the middle.
    const Vector3f across(spot.average.x() * (1 + 0.006f * std::abs(spot.average.y() + 66)), spot.average.y() / 9,
                          spot.average.z() / 9);
    height += lips * 0.16f * FractalNoise(across / 1.5f, 2, seed_ + 54) * resolved(1.3f);
  }
  return height;
}

Paint SkinPainter::At(const Spot& spot) const {
  if (spot.in_mouth) return InMouth(spot);
  const HumanRecipe& r = recipe_;
  const Vector3f& p = spot.point;
  const Vector3f& average = spot.average;
  const float lips = SampleMask(masks_.lips, spot.makehuman_uv);
  const float ears = SampleMask(masks_.ears, spot.makehuman_uv);
  const float eyelids = SampleMask(masks_.eyelids, spot.makehuman_uv);
  const float cheeks = CheekWeight(average), nose = NoseTipWeight(average), under_eye = UnderEyeWeight(average);

  // Pigments: large patches, blotches and fine speckle.
  const float patches = FractalNoise(p / 28, 3, seed_), blotches = FractalNoise(p / 7, 3, seed_ + 10),
              speckle = FractalNoise(p / 1.6f, 2, seed_ + 20);
  float melanin = static_cast<float>(r.melanin);
  melanin *= 1 + 0.10f * patches + 0.10f * blotches + 0.07f * speckle;
  melanin *= 1 + 0.10f * under_eye + 0.12f * eyelids + 0.06f * SmoothStep(30, 60, average.y());
  float blood = static_cast<float>(r.haemoglobin);
  blood *= 1 + 0.22f * patches + 0.30f * blotches + 0.14f * speckle;
  const float redness = static_cast<float>(r.redness);
  blood += redness * (0.55f * cheeks * (1 + 0.6f * blotches) + 0.65f * nose + 0.5f * ears) + 0.10f * eyelids;
  blood += 0.12f * under_eye;
  if (r.freckles > 0.02) {
    const NearestSpot freckle = FindNearestSpot(p / 3.1f, seed_ + 30);
    const float chance =
        static_cast<float>(r.freckles) *
        std::max({SmoothStep(-62, -20, average.y()) * SmoothStep(24, -2, average.y()) * SmoothStep(-30, 8, average.z()),
                  0.3f * FaceWeight(average)}) *
        (1 - lips);
    if (UnitFromBits(freckle.id) < chance) {
      const float radius = 0.16f + 0.2f * UnitFromBits(freckle.id * 31);
      melanin += 0.22f * SmoothStep(radius, 0.4f * radius, freckle.distance + 0.08f * speckle);
    }
  }
  for (const Mole& mole : moles_) {
    const float distance = (p - mole.point).norm();
    if (distance < 2 * mole.radius)
      melanin += mole.strength * SmoothStep(1.1f * mole.radius, 0.6f * mole.radius, distance);
  }

  Paint paint;
  paint.albedo = SkinColour(melanin, blood);
  paint.height = Relief(spot, lips);
  // Less light reaches the bottom of pores and furrows than the normals alone tell.
  paint.albedo *= std::clamp(1 + 0.8f * paint.height, 0.7f, 1.1f);
  const float t_zone = TZoneWeight(average);
  const float oil = static_cast<float>(r.oiliness);
  paint.roughness = 0.54f - 0.08f * oil - (0.05f + 0.14f * oil) * t_zone + 0.05f * speckle;
  paint.specular = 0.75f + 0.25f * t_zone;

  // Lips: thin skin, so more blood shows and less melanin; dark skin keeps much of its own.
  if (lips > 0) {
    const float vary = FractalNoise(p / 3, 3, seed_ + 70);
    const Vector3f lip = 0.9f * SkinColour(melanin * 1.1f + 0.05f, 1.05f + 0.3f * vary + 0.2f * redness);
    const float soft = SmoothStep(0.05f, 1.0f, lips + 0.25f * blotches - 0.1f);
    paint.albedo += 0.8f * soft * (lip - paint.albedo);
    paint.roughness += soft * (0.36f - paint.roughness);
    // Where the lips meet they are wetter and darker.
    const float inner = soft * SmoothStep(4, 0, std::abs(average.y() + 66.5f)) * SmoothStep(31, 26, average.z());
    paint.albedo *= 1 - 0.3f * inner;
  }

  // The rim of the lids: moist and pink, with the roots of the lashes in front of it.
  if (average.z() > -25 && std::abs(average.y()) < 18) {
    float rim = 1e9f;
    for (const Vector3f& q : sheet_.lid_rims) rim = std::min(rim, (q - average).squaredNorm());
    rim = std::sqrt(rim);
    const float wet = SmoothStep(1.5f, 0.4f, rim);
    const Vector3f pink = SkinColour(melanin * 0.7f, 1.3f);
    paint.albedo += wet * 0.8f * (pink - paint.albedo);
    paint.roughness += wet * (0.3f - paint.roughness);
    const float lashes = SmoothStep(0.9f, 1.7f, rim) * SmoothStep(3.4f, 2.0f, rim);
    paint.albedo *= 1 - 0.35f * lashes * (average.y() > 0 ? 1.0f : 0.5f);
  }
  // Nostrils and the ear's canal swallow light.
  const Vector3f nostril(std::abs(average.x()) - 7, (average.y() + 40) / 1.2f, average.z() - 27);
  paint.albedo *= 1 - 0.75f * SmoothStep(7, 3, nostril.norm());

  // Hair: brows, stubble and the scalp.
  const float brow = brows_.Coverage(FrontalCoordinates(average)) * SmoothStep(-25, -10, average.z());
  if (brow > 0) {
    paint.albedo += std::min(1.25f * brow, 0.97f) * (0.6f * hair_ - paint.albedo);
    paint.height += 0.25f * brow;
    paint.specular *= 1 - 0.5f * brow;
  }
  if (r.stubble > 0) {
    const float beard = BeardWeight(average) * (1 - lips);
    const float growth = static_cast<float>(r.stubble) * beard * (0.75f + 0.5f * FractalNoise(p / 12, 2, seed_ + 80));
    if (growth > 0) {
      // Hairs just below the skin tint it; those above are dots.
      paint.albedo += 0.30f * growth * (1.3f * hair_ + Vector3f(0.01f, 0.02f, 0.03f) - paint.albedo);
      const NearestSpot hair = FindNearestSpot(p / 0.95f, seed_ + 81);
      const float dot = SmoothStep(0.34f, 0.12f, hair.distance) * (UnitFromBits(hair.id) < 0.85f ? 1.0f : 0.0f);
      paint.albedo += 0.75f * growth * dot * (hair_ - paint.albedo);
      paint.height += 0.06f * growth * dot;
      paint.roughness += 0.08f * growth;
    }
  }
  const float hairline = ScalpWeight(average, static_cast<float>(r.hairline)) * (1 - ears);
  const float ragged = 0.35f * FractalNoise(p / 3.5f, 3, seed_ + 90);
  const float scalp = hairline * std::clamp(1.3f * hairline + ragged - 0.15f, 0.0f, 1.0f);
  if (scalp > 0) {
    // What is seen between the hairs of hair.h: roots in their own shade.
    const float strands = 0.5f + 0.5f * FractalNoise(Vector3f(p.x() / 0.9f, p.y() / 2.2f, p.z() / 1.3f), 2, seed_ + 91);
    const float cover = std::min(0.97f, static_cast<float>(r.scalp_hair) * scalp * (0.85f + 0.3f * (strands - 0.5f)));
    paint.albedo += cover * ((0.35f + 0.35f * strands) * hair_ - paint.albedo);
    paint.height += 0.2f * scalp * strands;
    paint.roughness += scalp * (0.65f - paint.roughness);
    paint.specular *= 1 - 0.45f * scalp;
  }
  return paint;
}

// Copies painted texels into the gaps between charts, so that sampling at a border finds skin.
template <typename T>
void FillGaps(std::vector<uint8_t> painted, Image<T>* image) {
  const int size = image->width(), channels = image->channels();
  std::vector<size_t> gaps;
  for (size_t i = 0; i < painted.size(); ++i) {
    if (!painted[i]) gaps.push_back(i);
  }
  for (int round = 0; round < 8; ++round) {
    std::vector<size_t> filled;
    for (const size_t gap : gaps) {
      const int x = static_cast<int>(gap % size), y = static_cast<int>(gap / size);
      float sum[4] = {};
      int count = 0;
      for (const auto& [dx, dy] : {std::pair(-1, 0), std::pair(1, 0), std::pair(0, -1), std::pair(0, 1)}) {
        const int nx = x + dx, ny = y + dy;
        if (nx < 0 || ny < 0 || nx >= size || ny >= size || !painted[static_cast<size_t>(ny) * size + nx]) continue;
        for (int c = 0; c < channels; ++c) sum[c] += static_cast<float>(image->at(nx, ny)[c]);
        ++count;
      }
      if (count == 0) continue;
      for (int c = 0; c < channels; ++c) image->at(x, y)[c] = static_cast<T>(sum[c] / static_cast<float>(count));
      filled.push_back(gap);
    }
    for (const size_t gap : filled) painted[gap] = 1;
    std::erase_if(gaps, [&](size_t gap) { return painted[gap] != 0; });
  }
}

}  // namespace

SkinMasks ReadSkinMasks(const std::filesystem::path& data_folder) {
  const std::filesystem::path folder = data_folder / "mpfb2" / "textures";
  SkinMasks masks;
  ImageU8* const images[] = {&masks.lips, &masks.ears, &masks.eyelids};
  const char* const names[] = {"mpfb_lips.jpg", "mpfb_ears.jpg", "mpfb_eyelids.jpg"};
  ParallelFor(3, [&](int64_t i) { *images[i] = ReadImage(folder / names[i], 1); });
  return masks;
}

Material PaintSkin(const SkinSheet& sheet, const SkinMasks& masks, const HumanRecipe& recipe) {
  const int size = recipe.texture_size;
  const MeshTopology& topology = *sheet.topology;
  const TexelMap map = MapTexels(topology, size);
  const SkinPainter painter(sheet, masks, recipe);
  Material material;
  material.albedo = ImageU8(size, size, 3);
  material.normal_map = ImageF(size, size, 3);
  material.roughness_map = ImageF(size, size, 1);
  material.specular_map = ImageF(size, size, 1);
  material.specular_f0 = 0.042f;
  material.scatter = {0.32f, 0.15f, 0.09f};
  ImageF height(size, size, 1);
  ImageF texel_mm(size, size, 2);  // sides of a texel along u and v
  std::vector<uint8_t> painted(static_cast<size_t>(size) * size, 0);

  ParallelFor(size, [&](int64_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < size; ++x) {
      const TexelMap::Texel& texel = map.at(x, y);
      if (texel.triangle < 0) continue;
      const Eigen::Vector3i& t = topology.triangles[texel.triangle];
      const Eigen::Vector3i& tu = topology.triangle_uvs[texel.triangle];
      const float weights[3] = {1 - texel.b1 - texel.b2, texel.b1, texel.b2};
      Spot spot;
      spot.point.setZero();
      spot.average.setZero();
      spot.makehuman_uv.setZero();
      for (int k = 0; k < 3; ++k) {
        spot.point += weights[k] * sheet.points.row(t[k]).transpose();
        spot.average += weights[k] * sheet.average.row(t[k]).transpose();
        spot.makehuman_uv += weights[k] * sheet.makehuman_uvs[texel.triangle][k];
      }
      spot.in_mouth = texel.triangle >= sheet.first_mouth_triangle;
      const Vector3f e1 = (sheet.points.row(t[1]) - sheet.points.row(t[0])).transpose();
      const Vector3f e2 = (sheet.points.row(t[2]) - sheet.points.row(t[0])).transpose();
      const Vector2f d1 = topology.uvs[tu[1]] - topology.uvs[tu[0]], d2 = topology.uvs[tu[2]] - topology.uvs[tu[0]];
      const float area = d1.x() * d2.y() - d1.y() * d2.x();
      const float scale = area != 0 ? 1 / (area * static_cast<float>(size)) : 0;
      const float along_u = ((e1 * d2.y() - e2 * d1.y()) * scale).norm();
      const float along_v = ((e2 * d1.x() - e1 * d2.x()) * scale).norm();
      texel_mm.at(x, y)[0] = std::max(along_u, 0.02f);
      texel_mm.at(x, y)[1] = std::max(along_v, 0.02f);
      spot.texel_mm = std::sqrt(std::max(along_u * along_v, 1e-6f));

      const Paint paint = painter.At(spot);
      for (int c = 0; c < 3; ++c) material.albedo.at(x, y)[c] = EncodeSrgb(paint.albedo[c]);
      *height.at(x, y) = paint.height;
      *material.roughness_map.at(x, y) = std::clamp(paint.roughness, 0.15f, 0.9f);
      *material.specular_map.at(x, y) = paint.specular;
      painted[static_cast<size_t>(y) * size + x] = 1;
    }
  });
  FillGaps(painted, &material.albedo);
  FillGaps(painted, &material.roughness_map);
  FillGaps(painted, &material.specular_map);
  FillGaps(painted, &height);

  ParallelFor(size, [&](int64_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < size; ++x) {
      Vector3f normal(0, 0, 1);
      if (painted[static_cast<size_t>(y) * size + x]) {
        const int x0 = std::max(x - 1, 0), x1 = std::min(x + 1, size - 1);
        const int y0 = std::max(y - 1, 0), y1 = std::min(y + 1, size - 1);  // v grows as y falls
        const float du = (*height.at(x1, y) - *height.at(x0, y)) / (2 * texel_mm.at(x, y)[0]);
        const float dv = (*height.at(x, y0) - *height.at(x, y1)) / (2 * texel_mm.at(x, y)[1]);
        normal = Vector3f(-du, -dv, 1).normalized();
      }
      for (int c = 0; c < 3; ++c) material.normal_map.at(x, y)[c] = normal[c];
    }
  });
  return material;
}

}  // namespace likeness
