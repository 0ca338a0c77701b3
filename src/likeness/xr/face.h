// The avatar's face on the graphics device: decoded for both eyes' views beside the frames, which wait for it no longer
// than they can.

#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>

#include "likeness/render/gl/mesh_renderer.h"
#include "likeness/viewer/decode_thread.h"

namespace likeness {

class VrFace {
 public:
  using Clock = std::chrono::steady_clock;

  // For the OpenGL context that is current now and in every call.
  VrFace(const GlFunctions& gl, std::shared_ptr<const ViewedAvatar> avatar);

  // Asks for a face and waits for it until `deadline`. What comes later is shown by the next call that finds it.
  // Throws Error when it cannot be decoded.
  void Show(DecodeRequest request, Clock::time_point deadline);

  bool any() const { return faces_ > 0; }                             // whether there is something to draw
  bool current() const { return any() && shown_.request == asked_; }  // whether it is what was asked for last
  const DecodedViews& shown() const { return shown_; }

  // As GlMeshRenderer::Draw, with the texture of this eye.
  void Draw(size_t eye, const Camera& camera, const RigidTransform& world_from_head, const MeshStyle& style) const;

 private:
  bool Take();
  bool WaitForNews(Clock::time_point deadline);

  std::shared_ptr<const ViewedAvatar> avatar_;
  GlMeshRenderer renderer_;
  std::array<GlTextureStream, 2> textures_;
  DecodeRequest asked_;
  DecodedViews shown_;
  int faces_ = 0;
  std::mutex mutex_;
  std::condition_variable news_;
  bool has_news_ = false;
  DecodeThread decoding_;  // last: it ends first
};

}  // namespace likeness
