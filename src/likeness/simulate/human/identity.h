// From the base mesh to one person: macro and local targets, and the person's eyes and head centre.

#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "likeness/simulate/head.h"
#include "likeness/simulate/human/base_mesh.h"
#include "likeness/simulate/human/recipe.h"
#include "likeness/simulate/human/target.h"

namespace likeness {

struct EyeFit {
  Eigen::Vector3f centre;  // head space, mm
  float radius;            // of the sclera, mm
};

struct Identity {
  // The whole body mesh in head space. The head's centre lies on the line of sight between the eyes, half-way between
  // forehead and back of the skull, so that face and skull are within about 120 mm of it.
  Vertices vertices;
  std::array<EyeFit, 2> eyes;  // by Side
};

// Throws Error when a target file is missing or wrong.
Identity ShapeIdentity(const BaseMesh& base, const std::filesystem::path& data_folder, const HumanRecipe& recipe);

// The 52 expression shapes in the order of ExpressionNames(), millimetres.
std::vector<Target> ReadExpressionTargets(const std::filesystem::path& data_folder, int vertex_count);

}  // namespace likeness
