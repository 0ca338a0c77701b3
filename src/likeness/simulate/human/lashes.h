// Eyelashes: thin curved blades that stand on the front edges of the lids and follow them.

#pragma once

#include <vector>

#include "likeness/geometry/mesh.h"
#include "likeness/simulate/human/atlas.h"
#include "likeness/simulate/human/identity.h"
#include "likeness/simulate/human/recipe.h"

namespace likeness {

class Lashes {
 public:
  static constexpr float kCoverage = 0.4f;  // of a blade: it is that much wider than a lash

  Lashes() = default;
  //   upper_rim, lower_rim  fine vertices along the front edge of each lid, from corner to corner (smaller x first)
  Lashes(std::vector<int> upper_rim, std::vector<int> lower_rim, Side side, const HumanRecipe& recipe);

  const MeshTopology& topology() const { return topology_; }
  Vertices Positions(const Vertices& fine, const EyeFit& eye) const;

 private:
  struct Lash {
    bool upper;
    float place;   // along the rim, in vertices
    float length;  // mm
    float slant;   // sideways, per length
    float lift;    // how far it bends up (upper) or down (lower)
  };
  std::vector<int> upper_rim_, lower_rim_;
  std::vector<Lash> lashes_;
  MeshTopology topology_;
};

}  // namespace likeness
