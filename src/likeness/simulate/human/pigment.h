// Colours of skin, hair and irises from the pigments in them. All are linear RGB in [0, 1].

#pragma once

#include <Eigen/Core>

namespace likeness {

// Diffuse reflectance of skin: a pale dermis behind two absorbing layers, melanin above and blood below
// (Beer-Lambert; absorption per channel fitted by eye to photographs of light, medium and dark skin).
//   melanin, haemoglobin  0 ... 1 as in HumanRecipe; local values may be a little more
Eigen::Vector3f SkinColour(float melanin, float haemoglobin);

// Hair: `melanin` 0 light blond ... 1 black, `redness` 0 ash ... 1 ginger, `grey` 0 ... 1.
Eigen::Vector3f HairColour(float melanin, float redness, float grey);

uint8_t EncodeSrgb(float linear);

}  // namespace likeness
