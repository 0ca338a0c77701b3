#include "likeness/avatar/avatar_id.h"

#include <fmt/format.h>

#include <string_view>

#include "likeness/base/random.h"

namespace likeness {
namespace {

constexpr char kMeshBias[] = "decoder.mesh_fc.bias", kTextureBias[] = "decoder.texture_fc.bias";

uint64_t HashOf(std::span<const std::byte> bytes) {
  return Hash(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

std::string IdFrom(std::span<const std::byte> mesh_bias, std::span<const std::byte> texture_bias) {
  return fmt::format("{:016x}", Hash({HashOf(mesh_bias), HashOf(texture_bias)}));
}

}  // namespace

std::string AvatarId(const Avatar& avatar) {
  const auto bytes = [&](const char* name) { return std::as_bytes(std::span(avatar.weights.at(name).values)); };
  return IdFrom(bytes(kMeshBias), bytes(kTextureBias));
}

std::string AvatarId(const SafetensorsFile& file) { return IdFrom(file.Bytes(kMeshBias), file.Bytes(kTextureBias)); }

}  // namespace likeness
