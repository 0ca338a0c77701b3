// The lights of a capture stage: many even, distant lights on a sphere around the head.

#pragma once

#include <Eigen/Core>
#include <vector>

namespace likeness {

// A distant white light.
struct Light {
  Eigen::Vector3f direction = Eigen::Vector3f::UnitZ();  // unit, in world space, from the head towards the light
  float irradiance = 1;                                  // on a surface that faces the light; 1 white, pi diffuse = 1
};

struct LightRig {
  std::vector<Light> lights;
  // Half the angle that one light spans, radians: highlights on wet surfaces are as large as this.
  float angular_radius = 0.08f;
};

// `count` lights, evenly spread over the sphere (a Fibonacci lattice). Those in front and above, a little to the
// subject's left, are brighter: wholly even light leaves a face flat. A white diffuse surface that faces +z in the open
// sends out `white` (linear, 1 is the image's white). Lombardi et al. 2018 use 200 point lights.
LightRig EvenLights(int count, float white = 0.75f);

}  // namespace likeness
