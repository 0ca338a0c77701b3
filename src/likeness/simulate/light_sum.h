// Adds up what all lights do at one surface point: the inner loop of the renderer.

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "likeness/simulate/light_rig.h"

namespace likeness {

// The lights as columns, in groups of 16 neighbours so that a group is often wholly hidden; the last group is filled up
// with lights of no strength.
class LightTable {
 public:
  static constexpr int kGroup = 16;

  explicit LightTable(const LightRig& rig);

  int size() const { return static_cast<int>(x_.size()); }  // a multiple of kGroup
  int groups() const { return size() / kGroup; }
  float angular_radius() const { return angular_radius_; }
  Eigen::Vector3f Direction(int i) const { return {x_[i], y_[i], z_[i]}; }
  float Irradiance(int i) const { return irradiance_[i]; }

 private:
  friend struct LightColumns;
  std::vector<float> x_, y_, z_, irradiance_;
  float angular_radius_;
};

// One specular layer: GGX (Walter et al. 2007) with the height-correlated Smith term in Hammon's form (2017) and
// Schlick's Fresnel term.
struct SpecularLobe {
  float alpha = 0.25f;  // roughness squared
  float f0 = 0.04f;     // reflectance at normal incidence
};

// Where the lights are added up. All vectors are unit and in world space.
struct LightQuery {
  // Which lights reach the point: a bit for each light of a group, interpolated between a triangle's three corners.
  const uint16_t* visible[3] = {};
  float weights[3] = {1, 0, 0};
  Eigen::Vector3f diffuse_normal[3];  // per colour channel: scattering blurs fine relief
  float wrap[3] = {0, 0, 0};          // how far light wraps around, per channel
  Eigen::Vector3f normal;             // of the specular layers
  Eigen::Vector3f view;               // towards the camera
  SpecularLobe specular;
  SpecularLobe coat;
  bool has_specular = true;
  bool has_coat = false;
};

// Reflected radiance over albedo for the diffuse part, reflected radiance for the others.
struct LightSum {
  float diffuse[3] = {0, 0, 0};  // sum of E max(0, n.l + w) / (1 + w)^2 / pi
  float specular = 0;            // sum of E D V F max(0, n.l)
  float coat = 0;
};

LightSum SumLights(const LightTable& lights, const LightQuery& query);

}  // namespace likeness
