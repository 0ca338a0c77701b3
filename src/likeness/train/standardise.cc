#include "likeness/train/standardise.h"

#include <cmath>

#include "likeness/base/error.h"

namespace likeness {

Statistics StatisticsOf(const Avatar& avatar, int identity) {
  const Identity& person = avatar.identities.at(identity);
  return {person.texture_mean, static_cast<float>(std::sqrt(avatar.texture_variance)), person.vertex_mean,
          static_cast<float>(std::sqrt(avatar.vertex_variance))};
}

void StandardiseTexture(const Statistics& statistics, const ImageU8& texture, const ImageU8& seen, float* out) {
  const ImageF& mean = statistics.texture_mean;
  LIKENESS_CHECK(texture.width() == mean.width() && texture.height() == mean.height() && texture.channels() == 3);
  LIKENESS_CHECK(seen.empty() || (seen.width() == mean.width() && seen.height() == mean.height()));
  const float scale = 1 / statistics.texture_deviation;
  const uint8_t* pixel = texture.values().data();
  const uint8_t* weight = seen.values().data();
  const float* centre = mean.values().data();
  const size_t texels = static_cast<size_t>(mean.width()) * mean.height();
  for (size_t i = 0; i < texels; ++i, pixel += 3, centre += 3, out += 3) {
    const bool valid = seen.empty() ? (pixel[0] | pixel[1] | pixel[2]) != 0 : weight[i] != 0;
    const float factor = valid ? scale : 0;
    for (int c = 0; c < 3; ++c) out[c] = (static_cast<float>(pixel[c]) - centre[c]) * factor;
  }
}

void StandardiseVertices(const Statistics& statistics, const Vertices& vertices_in_head, float* out) {
  LIKENESS_CHECK(vertices_in_head.rows() == statistics.vertex_mean.rows());
  Eigen::Map<Vertices>(out, vertices_in_head.rows(), 3) =
      (vertices_in_head - statistics.vertex_mean) / statistics.vertex_deviation;
}

ImageF RestoreTexture(const Statistics& statistics, const float* values) {
  ImageF texture = statistics.texture_mean;
  for (float& value : texture.values()) value += *values++ * statistics.texture_deviation;
  return texture;
}

Vertices RestoreVertices(const Statistics& statistics, const float* values) {
  const auto rows = statistics.vertex_mean.rows();
  return statistics.vertex_mean + Eigen::Map<const Vertices>(values, rows, 3) * statistics.vertex_deviation;
}

}  // namespace likeness
