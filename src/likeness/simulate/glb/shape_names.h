// Which morph targets of a model make which of the 52 ARKit expressions.

#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/simulate/head.h"

namespace likeness {

// The expression that a name stands for, -1 for none. Loosely: case, underscores, dots, blanks and hyphens do not
// count, the side may be Left or L, and words before it, such as ARKit_ or a mesh's name, are dropped.
int ExpressionFromName(std::string_view name);

// What a shape-map file says: expressions as weighted sums of the model's own morph targets.
struct ShapeMap {
  struct Term {
    std::string target;
    float weight = 0;
  };
  std::array<std::vector<Term>, kExpressionCount> terms;  // empty: not in the map
};

// {"JawOpen": {"MouthOpen_h": 1.3}, ...}: an object of expressions, spelt loosely, with an object of targets and
// weights each. Throws Error naming the file for anything else.
ShapeMap ParseShapeMap(const std::filesystem::path& path_for_errors, std::string_view text);

// One morph target's part in an expression.
struct ShapeTerm {
  int target = 0;  // index into the names
  float weight = 0;
};

// For each expression the targets of one mesh that make it. What the map lists is taken from the map, its targets'
// names equal but for words in front that end in a dot, colon or underscore (h_teeth.t_MouthOpen_h is MouthOpen_h);
// the others by ExpressionFromName.
std::array<std::vector<ShapeTerm>, kExpressionCount> MatchShapes(const std::vector<std::string>& target_names,
                                                                 const ShapeMap& map);

}  // namespace likeness
