#include "likeness/train/model.h"

#include <torch/types.h>

#include <algorithm>
#include <cmath>

#include "likeness/base/error.h"
#include "likeness/train/device.h"
#include "likeness/train/network.h"
#include "likeness/train/standardise.h"

namespace likeness {

struct AvatarModel::Impl {
  Impl(Avatar loaded, torch::Device on)
      : avatar(std::move(loaded)),
        device(on),
        network(avatar.architecture, avatar.weights, torch::TensorOptions(torch::kFloat32).device(on)),
        statistics(StatisticsOfAll(avatar)) {}

  static std::vector<Statistics> StatisticsOfAll(const Avatar& avatar) {
    std::vector<Statistics> all;
    for (int i = 0; i < avatar.architecture.identities; ++i) all.push_back(StatisticsOf(avatar, i));
    return all;
  }

  // [1, ConditionChannels]; undefined where there are none. Throws Error where the conditions are not the avatar's.
  torch::Tensor Condition(const FrameConditions& conditions) const {
    const std::vector<float> c = ConditionVector(avatar, conditions);
    return c.empty() ? torch::Tensor() : torch::tensor(c).unsqueeze(0).to(device);
  }

  const Avatar avatar;
  const torch::Device device;
  const Network network;                     // borrows the avatar's weights on the CPU
  const std::vector<Statistics> statistics;  // of each person
};

std::unique_ptr<AvatarModel> AvatarModel::Load(const std::filesystem::path& avatar_file, const std::string& device) {
  return std::make_unique<AvatarModel>(LoadAvatar(avatar_file), device);
}

AvatarModel::AvatarModel(Avatar avatar, const std::string& device) {
  avatar.Check("avatar");
  impl_ = std::make_unique<Impl>(std::move(avatar), FindDevice(device));
}

AvatarModel::~AvatarModel() = default;

const Avatar& AvatarModel::avatar() const { return impl_->avatar; }

std::vector<float> AvatarModel::Encode(const ImageU8& average_texture, const Vertices& vertices_in_head,
                                       const ImageU8& seen, const FrameConditions& conditions) const {
  const int size = impl_->avatar.architecture.texture_size, vertices = impl_->avatar.architecture.vertex_count;
  if (average_texture.width() != size || average_texture.height() != size || average_texture.channels() != 3) {
    throw Error("an average texture is {} x {} x {}; this avatar works with {} x {} x 3", average_texture.width(),
                average_texture.height(), average_texture.channels(), size, size);
  }
  if (!seen.empty() && (seen.width() != size || seen.height() != size || seen.channels() != 1)) {
    throw Error("a mask of seen texels is {} x {}; this avatar works with {} x {}", seen.width(), seen.height(), size,
                size);
  }
  if (vertices_in_head.rows() != vertices) {
    throw Error("a mesh has {} vertices; this avatar has {}", vertices_in_head.rows(), vertices);
  }
  const torch::NoGradGuard no_grad;
  const torch::Tensor condition = impl_->Condition(conditions);
  const Statistics& statistics = impl_->statistics[conditions.identity];
  const torch::Tensor texture = torch::empty({1, size, size, 3});
  const torch::Tensor mesh = torch::empty({1, 3 * vertices});
  StandardiseTexture(statistics, average_texture, seen, texture.mutable_data_ptr<float>());
  StandardiseVertices(statistics, vertices_in_head, mesh.mutable_data_ptr<float>());
  const Network::Encoding encoding =
      impl_->network.Encode(texture.permute({0, 3, 1, 2}).to(impl_->device), mesh.to(impl_->device), condition);
  const torch::Tensor mu = encoding.mu.cpu().contiguous();
  return {mu.const_data_ptr<float>(), mu.const_data_ptr<float>() + mu.numel()};
}

DecodedFrame AvatarModel::Decode(std::span<const float> code, const Eigen::Vector3d& view_in_head,
                                 const FrameConditions& conditions) const {
  const int latent = impl_->avatar.architecture.latent;
  if (static_cast<int>(code.size()) != latent) {
    throw Error("a code has {} values; this avatar's have {}", code.size(), latent);
  }
  if (!(std::abs(view_in_head.norm() - 1) < 1e-3)) {
    throw Error("a view vector is {} long; expected a unit vector", view_in_head.norm());
  }
  const torch::NoGradGuard no_grad;
  const torch::Tensor condition = impl_->Condition(conditions);
  const torch::Tensor z = torch::empty({1, latent}), view = torch::empty({1, 3});
  std::copy(code.begin(), code.end(), z.mutable_data_ptr<float>());
  Eigen::Map<Eigen::Vector3f>(view.mutable_data_ptr<float>()) = view_in_head.cast<float>();
  const Network::Decoding decoding = impl_->network.Decode(z.to(impl_->device), view.to(impl_->device), condition);
  const torch::Tensor texture = decoding.texture.cpu().permute({0, 2, 3, 1}).contiguous();
  const torch::Tensor vertices = decoding.vertices.cpu().contiguous();
  const Statistics& statistics = impl_->statistics[conditions.identity];
  return {RestoreTexture(statistics, texture.const_data_ptr<float>()),
          RestoreVertices(statistics, vertices.const_data_ptr<float>())};
}

}  // namespace likeness
