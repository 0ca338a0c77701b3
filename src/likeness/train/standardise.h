// Textures and vertices to the network's units and back: (value - mean) / deviation.

#pragma once

#include "likeness/avatar/avatar.h"
#include "likeness/geometry/mesh.h"
#include "likeness/image/image.h"

namespace likeness {

// Statistics of a person's training part: a mean for every texel and vertex, one deviation for each kind of value.
struct Statistics {
  ImageF texture_mean;          // RGB, 0 ... 255, row 0 is v = 1
  float texture_deviation = 1;  // 0 ... 255
  Vertices vertex_mean;         // mm
  float vertex_deviation = 1;   // mm
};

Statistics StatisticsOf(const Avatar& avatar, int identity);

// Writes S x S x 3 values, as the image has them. A texel that is not seen becomes 0, the mean.
//   seen  S x S, 0 where a texel was not seen; empty: where the texel is (0, 0, 0)
void StandardiseTexture(const Statistics& statistics, const ImageU8& texture, const ImageU8& seen, float* out);
void StandardiseVertices(const Statistics& statistics, const Vertices& vertices_in_head, float* out);

ImageF RestoreTexture(const Statistics& statistics, const float* values);
Vertices RestoreVertices(const Statistics& statistics, const float* values);

}  // namespace likeness
