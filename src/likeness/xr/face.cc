#include "likeness/xr/face.h"

#include <algorithm>
#include <string>
#include <utility>

#include "likeness/base/error.h"

namespace likeness {

VrFace::VrFace(const GlFunctions& gl, std::shared_ptr<const ViewedAvatar> avatar)
    : avatar_(std::move(avatar)), renderer_(gl), textures_{GlTextureStream(gl), GlTextureStream(gl)}, decoding_([this] {
        {
          const std::lock_guard lock(mutex_);
          has_news_ = true;
        }
        news_.notify_one();
      }) {
  renderer_.SetTopology(avatar_->topology);
}

void VrFace::Show(DecodeRequest request, Clock::time_point deadline) {
  if (!(request == asked_)) {
    asked_ = std::move(request);
    decoding_.Decode(avatar_, asked_);
  }
  bool came = Take();
  while (!current() && WaitForNews(deadline)) came = Take() || came;
  if (came) {
    renderer_.SetVertices(shown_.vertices_in_head);
    for (size_t i = 0; i < shown_.textures.size(); ++i) {
      textures_[i].Upload(shown_.textures[i].data(), avatar_->architecture.texture_size);
    }
  }
}

bool VrFace::Take() {
  const std::string error = decoding_.TakeError();
  if (!error.empty()) throw Error("{}", error);
  if (!decoding_.TakeViews(&shown_)) return false;
  ++faces_;
  return true;
}

bool VrFace::WaitForNews(Clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  const bool news = news_.wait_until(lock, deadline, [&] { return has_news_; });
  has_news_ = false;
  return news;
}

void VrFace::Draw(size_t eye, const Camera& camera, const RigidTransform& world_from_head,
                  const MeshStyle& style) const {
  // A fixed view has one texture for both.
  const size_t texture = std::min(eye, shown_.textures.size() - 1);
  renderer_.Draw(textures_[texture].id(), camera, world_from_head, 0, style);
}

}  // namespace likeness
