// The head of a model: its parts in head space, cut off below the neck, vertices joined across seams, with the 52
// expressions as linear shapes.

#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "likeness/simulate/glb/find_eyes.h"
#include "likeness/simulate/glb/gather.h"
#include "likeness/simulate/human/linear_shapes.h"

namespace likeness {

struct HeadModel {
  LinearShapes shapes;  // of all vertices; millimetres, head space
  std::vector<ModelSurface> surfaces;
  std::array<ModelEye, 2> eyes;  // by Side
  std::vector<int> turns;        // for each vertex: the Side of the eye that it turns with, -1 for none
  std::vector<bool> on_cut;      // vertices made by the cut below the neck
  bool is_cut = false;
  std::vector<std::string> missing;  // expressions without a shape, but for gaze where eyes turn
};

// How far below the eyes the neck is cut, for eyes that are 64 mm apart.
inline constexpr float kCutBelowEyesMm = 170;

// The origin is between the eyes in width and height and in the middle of the skull in depth, as with human heads.
// Throws Error, naming the file, when the scene has no morph targets that stand for expressions, no face (two eyeballs,
// or shapes that close two eyes), or a unit in which no face is as large as one.
HeadModel BuildHeadModel(const std::filesystem::path& path_for_errors, const GltfScene& scene, const ShapeMap& map);

}  // namespace likeness
