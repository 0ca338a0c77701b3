// A network made ready for one kernel: weights packed, all memory laid out, and for each thread the list of what it
// does. Decoding is then a walk through lists.
//
// A frame has phases, at whose ends threads wait for each other: features of code and view; the first texture features,
// and the mesh; each early layer, split by columns; each middle layer, split by rows; and the cascade, in which each
// thread makes its share of the texture's rows depth first: a row of one layer is made as soon as the next one needs
// it, into rings of four lines, so that large features never leave the cache. Rows that two threads need are made by
// both. Every value is computed in the same way whatever the number of threads.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "likeness/base/team.h"
#include "likeness/decode/frame_checks.h"
#include "likeness/decode/kernel.h"
#include "likeness/decode/memory.h"
#include "likeness/decode/network.h"

namespace likeness {

// One frame to decode: borrowed buffers of the caller.
struct FrameRequest {
  const float* code = nullptr;  // [latent]
  int views = 0;
  float view[kMostViews][3] = {};
  uint8_t* pixels[kMostViews] = {};
  int64_t row_bytes[kMostViews] = {};
  PixelFormat format = PixelFormat::kRgba8;
  float* vertices = nullptr;  // null: no mesh
  int64_t vertex_bytes = 0;   // from one vertex to the next
};

// Floating-point operations and bytes of weights and biases that a frame needs, each counted once.
struct FrameCost {
  double flops = 0;
  double bytes = 0;
};

class Plan : public Team::Work {
 public:
  //   ranges  for kernels in fixed point: what TakeRanges of a plan in full precision gave
  // Throws Error when the kernel cannot represent a value of the network.
  Plan(const DecoderNetwork& network, const Kernel& kernel, int threads, std::span<const float> ranges = {});

  void Decode(const FrameRequest& request, Team& team);

  // Derivatives of the mesh by the code, at the code, in millimetres: for vertex k of the list (null: of all) those of
  // x, y, z are rows 3 k, 3 k + 1, 3 k + 2 of `out`, each of as many values as a code has.
  void Jacobian(const float* code, const int* vertices, int count, float* out, Team& team);

  const Kernel& kernel() const { return kernel_; }
  int64_t bytes() const { return memory_.bytes(); }
  FrameCost Cost(int views, bool mesh) const;

  // From now on the largest feature that enters each convolution is noted, until it is taken; of kernels in full
  // precision.
  void MeasureRanges();
  std::vector<float> TakeRanges();

 private:
  struct Generator;

  // Dense layers, packed.
  struct Dense {
    const void* weights = nullptr;
    const float* bias = nullptr;
    int in = 0, blocks = 0;
    float slope = 1;
  };
  // Features of a layer: texel (x, y) begins at offset + (y pitch + x) texel_bytes in a view's memory.
  struct Map {
    int size = 0, channels = 0;
    int64_t pitch = 0;  // texels
    int64_t offset = 0, texel_bytes = 0;
    int64_t At(int y, int x) const { return offset + (y * pitch + x) * texel_bytes; }
  };
  enum class Mode { kBlock, kRows, kCascade };
  struct Step {
    PackedConvolution packed;
    Mode mode = Mode::kRows;
    bool up = true;
    int in_size = 0, out_size = 0, out_channels = 0;  // padded
    Map out;                                          // of kBlock and kRows
    const std::byte* biases = nullptr;                // texel (0, -1)
    int64_t bias_pitch = 0;                           // bytes a row; 0: the same for all rows
    int64_t pixel_bias_pitch = 0;                     // bytes a job
    int64_t view_add = -1;                            // offset in a view's memory of what is added to this step's input
    int jobs = 0;                                     // rows of jobs: in_size + 1, or in_size
    Dense add;
  };
  // Offsets are into a view's memory.
  struct LineJob {
    const Step* step = nullptr;
    int64_t in[3] = {}, out[2] = {};
    const void* bias[2] = {};
    int row = 0;  // first image row of the results
  };
  struct Thread {
    std::vector<std::vector<LineJob>> rows;  // for each kRows step, then the cascade
    std::byte* scratch = nullptr;
    float* values = nullptr;    // sums, dense outputs
    std::vector<float> ranges;  // of features that enter each step; empty: not measured
  };

  unsigned Enter() override { return kernel_.enter(); }
  void Leave(unsigned mode) override { kernel_.leave(mode); }
  void Run(int phase, int thread) override;

  Dense PackDense(const DenseLayer& layer, std::span<const float> bias);
  void PackLayer(const DecoderNetwork& network, const ConvolutionLayer& layer, Step& step,
                 std::span<const float> ranges);
  void PackBiases(const DecoderNetwork& network, const ConvolutionLayer& layer, Step& step);
  void LayOut();
  void MakeJobs();

  void RunFeatures(int thread);
  void RunInner(int thread);
  void RunMesh(int thread);
  void RunBlock(const Step& step, int thread);
  void RunLines(const std::vector<LineJob>& jobs, int thread);
  void RunTexels(int thread);
  void RunColumns(int thread);
  void RunJacobian(int thread);
  int64_t BiasTexel(const Step& step) const;
  void NoteRange(int thread, size_t layer, const void* features, int count);
  std::pair<int, int> ShareOf(int count, int thread) const;
  float* ViewFloats(int view, int64_t offset) const { return reinterpret_cast<float*>(view_memory_[view] + offset); }
  const float* AddFor(size_t layer, int view) const;

  const Kernel& kernel_;
  const Architecture architecture_;
  const int threads_;
  Memory memory_;
  Dense code_, mesh_, view_, inner_, inner_view_, texels_;
  bool bilinear_ = false;
  int features_ = 0;                // values of the code's features
  int view_features_ = 0;           // of a view's
  std::vector<float> code_weight_;  // [features, latent], for derivatives; empty in linear models
  Map inner_map_;
  std::vector<Step> steps_;
  std::vector<Thread> thread_;
  std::byte* view_memory_[kMostViews] = {};
  int64_t view_bytes_ = 0;
  int64_t zero_line_ = 0, line_bytes_ = 0;                               // in a view's memory
  int64_t view_features_at_ = 0, inner_values_at_ = 0, factors_at_ = 0;  // floats in a view's memory
  float* code_features_ = nullptr;
  float* code_copy_ = nullptr;
  float* inner_shared_ = nullptr;
  // For derivatives.
  float* columns_ = nullptr;  // [latent, features]

  // The frame at hand.
  FrameRequest request_;
  struct {
    const int* vertices = nullptr;
    int count = 0;
    float* out = nullptr;
  } jacobian_;
  std::vector<int> phases_;  // what each phase of this frame is
};

}  // namespace likeness
