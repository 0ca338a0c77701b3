// Teeth and gums, modelled tooth by tooth along the dental arches of MakeHuman's coarse helper teeth.

#pragma once

#include "likeness/geometry/mesh.h"
#include "likeness/simulate/head.h"
#include "likeness/simulate/human/base_mesh.h"
#include "likeness/simulate/human/recipe.h"

namespace likeness {

enum class Jaw { kUpper, kLower };

struct JawMesh {
  MeshTopology topology;
  Vertices vertices;  // on the base mesh, mm
};

// Fourteen crowns; u tells the tooth, v runs from the edge (0) to the root (1).
JawMesh MakeTeeth(Jaw jaw);
// The gums around them, scalloped.
JawMesh MakeGums(Jaw jaw);

Material TeethMaterial(const HumanRecipe& recipe);
Material GumMaterial(const HumanRecipe& recipe);
Material TongueMaterial(const HumanRecipe& recipe);

// Lets points follow a helper mesh: rows over all coarse vertices that apply to each point the affine map which fits
// the helper's vertices best (least squares), [points x coarse].
Stencil FollowAffinely(const Vertices& points, const Vertices& coarse, const std::vector<int>& helper);

}  // namespace likeness
