// Going on from a finished avatar, for example with the image loss.

#pragma once

#include <filesystem>

#include "likeness/avatar/avatar.h"
#include "likeness/train/options.h"
#include "likeness/train/people.h"

namespace likeness {

// Sets what decides the network (size, latent, model, ..., conditions) to the avatar's. Normalisation by batch becomes
// "weight", as an avatar file has no statistics to go on from.
void AdoptNetwork(const Avatar& avatar, TrainOptions* options);

// Throws Error, with the difference, unless a network of this architecture can take the avatar's weights: everything
// but preset and normalisation is the same, the meshes have the same topology, and several people are the same ones in
// the same order.
void CheckOrigin(const std::filesystem::path& path, const Avatar& avatar, const Architecture& architecture,
                 const People& people);

}  // namespace likeness
