// A head that can be posed and rendered: the common shape of human, procedural and (later) GLB heads.
//
// Two things come out of a pose. The *scene* is what cameras see: skin, eyes, teeth, tongue, mouth cavity, lashes,
// hair. The *tracked mesh* is what a real tracker would give: one skin-like surface of fixed topology without eyeballs,
// teeth, tongue and lashes, but without holes either.
//
// Space: head space, millimetres; x to the subject's left, y up, z out of the nose; the origin is the head's centre.

#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "likeness/geometry/mesh.h"
#include "likeness/image/image.h"

namespace likeness {

// The 52 ARKit coefficients in Live Link Face's order and spelling, lower camel case: "eyeBlinkLeft", ...
// All weights are in [0, 1].
inline constexpr int kExpressionCount = 52;
const std::array<std::string, kExpressionCount>& ExpressionNames();
int ExpressionIndex(const std::string& name);  // throws Error for an unknown name

// How a surface answers to light. Maps are sampled with the surface's own uvs; an empty map means the constant.
struct Material {
  ImageU8 albedo;        // RGB, sRGB-encoded; or RGBA where alpha is coverage (lashes, hair)
  ImageF normal_map;     // 3 channels, tangent space (u right, v up), unit length, not encoded; may be empty
  ImageF roughness_map;  // 1 channel, GGX alpha = roughness^2; may be empty
  ImageF specular_map;   // 1 channel, scales the specular lobe; may be empty (1)
  float roughness = 0.5f;
  float specular_f0 = 0.04f;  // Fresnel reflectance at normal incidence
  std::array<float, 3> scatter = {0, 0,
                                  0};  // how far light wraps around (0 ... 1) per channel: cheap subsurface scattering
  float coat = 0;                      // weight of a second, smooth specular layer (wet: cornea, lips, tongue)
  float coat_roughness = 0.05f;
  bool transparent = false;  // only its coat is seen; what is behind shows through (cornea)
  bool casts_shadow = true;
};

struct Surface {
  std::string name;  // "skin", "left eye", ...
  MeshTopology topology;
  Material material;
};

// Positions for one set of weights.
struct PosedHead {
  std::vector<Vertices> surfaces;  // one for each Head::surfaces()
  std::vector<Vertices> normals;   // smooth vertex normals, likewise
  Vertices tracked;                // of Head::tracked_topology()
};

class Head {
 public:
  virtual ~Head() = default;
  virtual const std::string& name() const = 0;  // "human:7", "procedural"
  virtual const std::vector<Surface>& surfaces() const = 0;
  virtual const MeshTopology& tracked_topology() const = 0;  // one atlas in [0, 1] without overlap
  virtual PosedHead Pose(std::span<const float, kExpressionCount> weights) const = 0;
};

}  // namespace likeness
