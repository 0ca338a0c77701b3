#include "likeness/app/avatar_painter.h"

#include <algorithm>
#include <utility>

#include "likeness/base/error.h"
#include "likeness/base/parallel.h"
#include "likeness/render/rasterizer.h"

namespace likeness {
namespace {

std::shared_ptr<Team> MakeTeam() {
  constexpr int kMostThreads = 64;
  Team::Options options;
  options.threads = std::min(ThreadCount(), kMostThreads);
  return std::make_shared<Team>(options);
}

FrameRendererOptions RendererOptions(std::shared_ptr<Team> team, std::array<uint8_t, 3> background, bool transparent) {
  FrameRendererOptions options;
  options.anti_alias = true;
  options.background = background;
  options.transparent = transparent;
  options.team = std::move(team);
  return options;
}

ImageU8 WithoutOpacity(const ImageU8& picture) {
  ImageU8 rgb(picture.width(), picture.height(), 3);
  const uint8_t* from = picture.row(0);
  uint8_t* to = rgb.row(0);
  for (int i = 0; i < picture.width() * picture.height(); ++i, from += 4, to += 3) std::copy_n(from, 3, to);
  return rgb;
}

}  // namespace

AvatarPainter::AvatarPainter(std::filesystem::path avatar_file, std::array<uint8_t, 3> background, bool transparent)
    : file_(std::move(avatar_file)),
      transparent_(transparent),
      avatar_(LoadAvatar(file_)),
      team_(MakeTeam()),
      renderer_(avatar_.topology, avatar_.architecture.texture_size, RendererOptions(team_, background, transparent)),
      vertices_(static_cast<size_t>(avatar_.architecture.vertex_count) * 3) {
  const auto size = static_cast<size_t>(avatar_.architecture.texture_size);
  for (std::vector<uint8_t>& texture : textures_) texture.resize(4 * size * size);
}

std::vector<ImageU8> AvatarPainter::Paint(std::span<const float> code, const FrameConditions& conditions,
                                          std::span<const Camera> cameras, const RigidTransform& world_from_head) {
  LIKENESS_CHECK(!cameras.empty() && cameras.size() <= FrameRenderer::kMostViews);
  const bool same = open_.identity == conditions.identity && open_.values == conditions.values;
  if (decoder_ == nullptr || !same) Open(conditions);
  std::vector<ImageU8> pictures;
  std::vector<Decoder::View> decoded;
  std::vector<FrameRenderer::View> drawn;
  for (const Camera& camera : cameras) {
    uint8_t* const texture = textures_[pictures.size()].data();
    ImageU8& picture = pictures.emplace_back(camera.width, camera.height, 4);
    const Eigen::Vector3f view = ViewVector(camera, world_from_head).cast<float>();
    decoded.push_back({{view.x(), view.y(), view.z()}, texture, int64_t{4} * avatar_.architecture.texture_size});
    drawn.push_back({ProjectionOf(camera, world_from_head), camera.width, camera.height, texture, picture.row(0),
                     int64_t{4} * camera.width});
  }
  decoder_->Decode(code, decoded, {vertices_.data(), 12});
  renderer_.Draw(vertices_, drawn);
  if (!transparent_) std::transform(pictures.begin(), pictures.end(), pictures.begin(), WithoutOpacity);
  return pictures;
}

void AvatarPainter::Open(const FrameConditions& conditions) {
  DecoderOptions options;
  options.team = team_;
  options.person = conditions.identity;
  options.conditions = conditions.values;
  if (decoder_ != nullptr) options.kernel = decoder_->kernel();
  decoder_ = Decoder::Open(file_, options);
  open_ = conditions;
}

}  // namespace likeness
