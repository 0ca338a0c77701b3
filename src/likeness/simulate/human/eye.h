// Eyeballs: a sclera with a flat iris behind a corneal bulge, turned by the eyeLook weights.

#pragma once

#include <Eigen/Core>

#include "likeness/geometry/mesh.h"
#include "likeness/simulate/gaze.h"

namespace likeness {

// Lengths as fractions of the sclera's radius. MakeHuman's eyes are larger than the mean adult's (13.8 mm, not 12 mm),
// so the iris is made a smaller part of them: its border lies 5.9 mm from the axis, the cornea's radius is 7.9 mm.
inline constexpr float kLimbus = 0.43f;        // radius of the border between iris and sclera
inline constexpr float kCorneaRadius = 0.57f;  // of the sphere that the cornea is a part of
inline constexpr float kIrisInUv = 0.25f;  // radius of the limbus in the eyeball's texture, whose centre is the pupil

struct EyeMesh {
  MeshTopology topology;
  Vertices vertices;  // about the eye's centre, the gaze along z
};

// Sclera and iris; only the front 120 degrees are needed.
EyeMesh MakeEyeball(float radius);
// The clear cornea and the film of tears over the front of the sclera, just outside of the eyeball.
EyeMesh MakeCornea(float radius);

// How far the eye reaches from its centre in a direction at `cosine` = cos(angle to the gaze), as a multiple of its
// radius: 1 on the sclera, more on the cornea.
float EyeReach(float cosine);

}  // namespace likeness
