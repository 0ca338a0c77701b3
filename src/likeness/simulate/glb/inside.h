// What of a skin is inside of the head: sockets behind the eyes, the inside of the mouth.

#pragma once

#include <vector>

#include "likeness/geometry/mesh.h"
#include "likeness/simulate/glb/find_eyes.h"

namespace likeness {

// For each triangle whether it belongs to the skin around an eye, and not to the socket behind its lids: false for the
// connected piece behind the eye's centre that neither the lids nor the ball let see from the front.
std::vector<bool> SeenInFrontOfEye(const Vertices& positions, const std::vector<Eigen::Vector3i>& triangles,
                                   const ModelEye& eye);

// Triangles of the inside of the mouth, ascending: the largest piece in the lower front of the head that cannot be seen
// from outside. `positions` and `triangles` have no hole but at the neck. Empty when nothing is hidden.
std::vector<int> FindMouth(const Vertices& positions, const std::vector<Eigen::Vector3i>& triangles);

}  // namespace likeness
