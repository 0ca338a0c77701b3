// What the parts of a model are: by their names, and eyeballs without a name by their shape.

#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "likeness/geometry/mesh.h"

namespace likeness {

enum class PartKind {
  kSkin,
  kEye,    // turns with the gaze
  kTear,   // tear glands, tear lines, shadows over the eyes
  kMouth,  // teeth, gums, tongue
  kHair,   // also brows and beards
  kLashes,
  kClothes,  // and glasses, jewels
};

// Of mesh, node and material names, the first that says something counts. kSkin when none does.
PartKind KindFromNames(std::string_view mesh, std::string_view node, std::string_view material);

struct Sphere {
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();
  float radius = 0;
  float error = 0;  // root mean square distance of the points from it
};

// The sphere nearest to some points; none for fewer than 8 or for flat ones. Points that lie far off (the iris behind
// a cornea) are left out of a second fit.
std::optional<Sphere> FitSphere(const std::vector<Eigen::Vector3f>& points);

}  // namespace likeness
