// Eyebrows as many short hairs, drawn once on the frontal map of the face.

#pragma once

#include <Eigen/Core>

#include "likeness/image/image.h"
#include "likeness/simulate/human/recipe.h"

namespace likeness {

class BrowDrawing {
 public:
  explicit BrowDrawing(const HumanRecipe& recipe);

  // How much hair covers a point of FrontalCoordinates(), 0 ... 1.
  float Coverage(const Eigen::Vector2f& frontal) const;

 private:
  void DrawHair(Eigen::Vector2f root, float angle, float curl, float length, float width);

  ImageF coverage_;
};

}  // namespace likeness
