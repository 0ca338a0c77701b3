// One frame of a head, placed in the world and lit: what all cameras of the frame share.

#pragma once

#include <cstdint>
#include <vector>

#include "likeness/geometry/ray_scene.h"
#include "likeness/geometry/rigid.h"
#include "likeness/simulate/head.h"
#include "likeness/simulate/light_sum.h"

namespace likeness {

struct LitHead {
  const Head* head = nullptr;                  // borrowed
  std::vector<Vertices> positions;             // world space, mm; one for each surface
  std::vector<Vertices> normals;               // world space, unit
  RayScene scene;                              // mesh i is surface i
  std::vector<std::vector<uint16_t>> visible;  // per surface [vertex][group of the table], a bit for each light
  // Per surface and vertex: the part of the light that would arrive there if nothing stood in its way, 0 ... 1.
  std::vector<std::vector<float>> openness;
  int64_t shadow_rays = 0;  // traced
};

// Places the head and, with `lights`, finds which lights each vertex sees: one shadow ray a vertex and light against
// all surfaces that cast shadows. Transparent surfaces and those with an alpha channel cast none. Lights a little below
// the horizon of a scattering surface count as if they stood on it. Uses all threads.
LitHead LightHead(const Head& head, const PosedHead& posed, const RigidTransform& world_from_head,
                  const LightTable* lights);

}  // namespace likeness
