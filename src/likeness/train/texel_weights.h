// How much each texel counts in the texture loss.

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "likeness/geometry/camera.h"
#include "likeness/geometry/mesh.h"
#include "likeness/geometry/rigid.h"
#include "likeness/image/image.h"

namespace likeness {

enum class TexelWeighting {
  // 1 where seen, 0 elsewhere: the paper's w. A texture counts by how much of it is seen.
  kAll,
  // Likewise, scaled so that the mean square is 1: every texture counts the same, a mean over its seen texels.
  kSeen,
  // By the pixels that a texel covers in the camera's image: what the eye, and an error in image space, weighs. Squares
  // are proportional to that area, with a floor for texels that are seen at a grazing angle, and their mean is 1.
  kPixels,
};
const std::vector<std::string>& TexelWeightingNames();  // "all", "seen", "pixels"
TexelWeighting ParseTexelWeighting(const std::string& name);

class TexelWeights {
 public:
  TexelWeights(MeshTopology topology, int size, TexelWeighting weighting);

  // Writes the size x size weights w of one texture, row 0 at v = 1; the loss has |w (T - T^)|^2.
  //   seen  255 or 0; without a texel seen all weights are 0
  void Write(const Camera& camera, const RigidTransform& world_from_head, const Vertices& vertices_in_head,
             const ImageU8& seen, float* weights) const;

 private:
  std::vector<float> PixelsOfTriangles(const Camera& camera, const RigidTransform& world_from_head,
                                       const Vertices& vertices_in_head) const;

  MeshTopology topology_;
  TexelWeighting weighting_;
  std::vector<int> triangle_;  // of each texel; -1: none. Empty unless weighting by pixels
  std::vector<float> texels_;  // area of each triangle in the texture, texels
};

}  // namespace likeness
