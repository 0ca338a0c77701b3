// A network made ready for a GPU: a compute shader for each layer, weights and biases in buffers of OpenGL's, and the
// order of what is run. A frame is an upload of a few kilobytes, the dispatches, and barriers between them.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "likeness/decode/frame_checks.h"
#include "likeness/decode/gl_frame.h"
#include "likeness/decode/gl_shaders.h"
#include "likeness/decode/network.h"
#include "likeness/gl/objects.h"

namespace likeness {

// What a layer takes in a frame. Bytes are those that memory must deliver or take when caches keep everything within a
// layer and nothing from one to the next.
struct GlLayerCost {
  std::string name;  // as the file's tensors are called, without "decoder."
  double flops = 0;  // of products, with padding
  double weight_bytes = 0;
  double bias_bytes = 0;
  double feature_bytes = 0;  // read and written; textures and vertices too
};

class GlPlan {
 public:
  // Throws Error when the context is older than 4.3, when the driver allows no buffer that is large enough, and when it
  // has no memory for it.
  GlPlan(const GlFunctions& gl, const DecoderNetwork& network, const GlStorage& storage);

  // Arguments have been checked. `directions` holds 0 to kMostViews unit vectors.
  void Decode(std::span<const float> code, std::span<const std::array<float, 3>> directions, bool mesh);

  GLuint texture(int view) const { return textures_[view].id(); }
  GLuint vertices() const { return vertices_.id(); }
  const GlStorage& storage() const { return storage_; }
  int64_t bytes() const { return bytes_; }  // of buffers, without textures
  std::vector<GlLayerCost> Costs(int views, bool mesh) const;

 private:
  // One dispatch.
  struct Pass {
    enum class Kind { kCode, kMesh, kTexture };
    Kind kind = Kind::kTexture;
    bool convolution = false;
    GlProgram program;
    GlBuffer weights, biases;
    GLuint input = 0, results = 0;
    int groups_x = 1;
    int rows = 0, rows_of_view = 0;  // in all: rows + views x rows_of_view
    int rows_at_once = 1;            // of a work group
    GlLayerCost cost, cost_of_view;  // the same
  };

  // A layer of inputs that both views share and of such as each has of its own; either may be empty.
  Pass DensePass(Pass::Kind kind, const std::string& name, const DenseLayer& shared, const DenseLayer& of_view,
                 const GlResults& results);
  Pass ConvolutionPass(const DecoderNetwork& network, size_t index);
  void AddConvolutions(const DecoderNetwork& network, GLuint features);
  // What the layer before convolution `next` makes.
  GlResults FeaturesFor(const DecoderNetwork& network, size_t next, float slope) const;
  GlBuffer NewBuffer(int64_t bytes, const void* data);
  GlBuffer Upload(std::span<const float> values, bool half);
  void Run(const Pass& pass, int views) const;
  double ValueBytes() const { return storage_.half ? 2 : 4; }
  double PixelBytes() const { return storage_.format == PixelFormat::kRgba8 ? 4 : 8; }

  const GlFunctions& gl_;
  const GlStorage storage_;
  int64_t most_bytes_ = 0;  // of a buffer that a shader reads
  int64_t bytes_ = 0;
  GlFrame frame_;
  GlBuffer frame_buffer_, code_features_, vertices_;
  GlBuffer maps_[2];  // features: what a convolution reads and what it writes, in turn
  GlTexture textures_[kMostViews];
  std::vector<Pass> passes_;
};

}  // namespace likeness
