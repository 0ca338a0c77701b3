// The run-time decoder on a GPU, by compute shaders of OpenGL 4.3: as decoder.h, but textures and vertices stay where a
// renderer needs them, in OpenGL's textures and a buffer. likeness.h is the same for C.

#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "likeness/avatar/architecture.h"
#include "likeness/avatar/safetensors.h"
#include "likeness/decode/accuracy.h"
#include "likeness/decode/gl_plan.h"
#include "likeness/decode/kernel.h"
#include "likeness/decode/network.h"

namespace likeness {

struct GlDecoderOptions {
  PixelFormat format = PixelFormat::kRgba8;  // of the textures, as decoder.h says
  // Of weights, biases and features: "half", "float" (32 bits, twice the memory traffic), or "auto": half where this
  // keeps the avatar's accuracy (accuracy.h), which is measured when it is opened. Sums are always in float32.
  std::string storage = "auto";
  int person = 0;  // whose face, of an avatar of several people; named conditions stay at their means
  DisplayTransform display;

  void Check() const;  // throws Error
};

// The context of `gl`, which outlives the decoder, is current in every call and at the end.
class GlDecoder {
 public:
  // Throws Error naming the file, and when the context cannot do it: it is older than 4.3, or lacks memory.
  //   network  made with the options' person and display transform
  GlDecoder(const GlFunctions& gl, const DecoderNetwork& network, const GlDecoderOptions& options);
  static std::unique_ptr<GlDecoder> Open(const GlFunctions& gl, const std::filesystem::path& avatar_file,
                                         const GlDecoderOptions& options = {});

  // Hands a frame to the GPU and returns; drawing that follows in this context sees it, without a wait or a barrier of
  // the caller's. No view: the mesh alone. Of the context's state these change: the program and the buffer at
  // GL_COPY_WRITE_BUFFER (none afterwards), image units 0 and 1, shader storage buffers 0 to 4. Throws Error, before
  // anything is written, when sizes do not fit or a value is not finite.
  //   code   [latent]
  //   views  0 to 2 unit vectors from the head's centre to the viewer, head space
  void Decode(std::span<const float> code, std::span<const std::array<float, 3>> views, bool mesh);

  // View 0 or 1: two-dimensional, texture_size texels a side, GL_RGBA8 or GL_RGBA16F; its first row (t = 0) is v = 1.
  // Smaller levels exist for glGenerateMipmap.
  GLuint texture(int view) const { return plan_->texture(view); }
  // x y z of each vertex, packed float32, millimetres, head space.
  GLuint vertices() const { return plan_->vertices(); }

  const Architecture& architecture() const { return architecture_; }
  bool half() const { return plan_->storage().half; }
  // Of half storage, where it was measured: with "auto".
  const KernelAccuracy* accuracy() const { return measured_ ? &accuracy_ : nullptr; }
  int64_t memory_bytes() const { return plan_->bytes(); }
  std::vector<GlLayerCost> Costs(int views, bool mesh) const { return plan_->Costs(views, mesh); }

  const std::vector<float>& mean_code() const { return mean_code_; }
  const std::vector<int32_t>& triangles() const { return triangles_; }        // [T, 3] vertex indices
  const std::vector<int32_t>& triangle_uvs() const { return triangle_uvs_; }  // [T, 3] indices into uvs
  const std::vector<float>& uvs() const { return uvs_; }                      // [U, 2], v up

 private:
  void ChoosePlan(const GlFunctions& gl, const DecoderNetwork& network, const GlDecoderOptions& options);

  Architecture architecture_;
  std::vector<float> mean_code_, uvs_;
  std::vector<int32_t> triangles_, triangle_uvs_;
  KernelAccuracy accuracy_;
  bool measured_ = false;
  std::unique_ptr<GlPlan> plan_;
};

}  // namespace likeness
