// Which avatar a code belongs to.

#pragma once

#include <string>

#include "likeness/avatar/avatar.h"
#include "likeness/avatar/safetensors.h"

namespace likeness {

// 16 hexadecimal digits made of the decoder's biases (decoder.mesh_fc.bias, decoder.texture_fc.bias): what else a file
// holds may change, and its name. Throws Error naming the file when it has no such tensors.
std::string AvatarId(const Avatar& avatar);
std::string AvatarId(const SafetensorsFile& file);

}  // namespace likeness
