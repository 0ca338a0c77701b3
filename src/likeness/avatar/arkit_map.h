// A map from the 52 ARKit coefficients, which phones measure of any face, to an avatar's codes.
//
//   code = bias + weights x terms(coefficients)
//
// where each term is a coefficient or the product of two. It stands in the avatar file, when likeness fit-arkit has put
// it there (docs/avatar-file.md).

#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "likeness/avatar/safetensors.h"

namespace likeness {

// Indices of a coefficient and of the one that it is multiplied with; -1: of none.
using ArkitTerm = std::array<int, 2>;

struct ArkitMap {
  std::vector<std::string> coefficients;  // names in the order of the input: "eyeBlinkLeft", ...
  std::vector<ArkitTerm> terms;
  std::vector<float> bias;     // [latent]
  std::vector<float> weights;  // [latent, terms]

  //   values  [coefficients], 0 ... 1
  //   returns [latent]
  std::vector<float> CodeOf(std::span<const float> values) const;

  // Throws Error, with `what` in front, unless everything fits and is finite.
  void Check(const std::string& what, int latent) const;
};

// The values of terms for a frame's coefficients, in their order.
std::vector<double> TermValues(const std::vector<ArkitTerm>& terms, std::span<const float> values);

// The map of an avatar file; none where it has none. Throws Error naming the file for one that is wrong.
//   latent  values of the avatar's codes
std::optional<ArkitMap> ReadArkitMap(const SafetensorsFile& avatar_file, int latent);

// Writes an avatar file again, with this map in place of its own; all else is copied as it stands there.
void WriteWithArkitMap(const std::filesystem::path& path, const SafetensorsFile& avatar_file, const ArkitMap& map);

}  // namespace likeness
