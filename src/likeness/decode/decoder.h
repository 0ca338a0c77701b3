// The run-time decoder: opens an avatar file, gives textures and the mesh for a code and one or two views. Without
// LibTorch; on the processor's best instructions. likeness.h is the same for C.

#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "likeness/avatar/architecture.h"
#include "likeness/avatar/safetensors.h"
#include "likeness/base/team.h"
#include "likeness/decode/accuracy.h"
#include "likeness/decode/kernel.h"
#include "likeness/decode/network.h"
#include "likeness/decode/plan.h"

namespace likeness {

struct DecoderOptions {
  // "auto": the fastest one that keeps this avatar's accuracy (below), or a kernel by name: AllKernels().
  std::string kernel = "auto";
  int threads = 2;                // 1 to 64; 0: as many as there are cores, up to 8
  bool pin = true;                // own threads to cores
  double spin_ms = 2;             // own threads wait so long for the next frame before they sleep
  int person = 0;                 // whose face, of an avatar of several people
  std::vector<float> conditions;  // of all named ones, as captured, for all frames; empty: their means
  DisplayTransform display;
  ParallelCallback parallel = nullptr;  // the caller's pool, in place of own threads
  void* pool = nullptr;
  // Threads shared with others who work by turns, such as the renderer: in place of all that the options say of
  // threads.
  std::shared_ptr<Team> team;

  // Throws Error for values out of range.
  void Check() const;
};

// Textures are square, RGBA, row 0 is v = 1, opacity 1.
//   kRgba8    colours from 0 to 255 as in training, rounded and clamped
//   kRgba16F  the same divided by 255, in half precision, not clamped beyond what the kernel holds: at least -2 to 2
// Vertices are x y z in float32, millimetres, head space.
class Decoder {
 public:
  struct View {
    float direction[3] = {0, 0, 1};  // unit vector from the head's centre to the viewer, head space
    void* pixels = nullptr;
    int64_t row_bytes = 0;  // from a row to the next, at least a row's size
  };
  struct Mesh {
    float* vertices = nullptr;
    int64_t vertex_bytes = 12;  // from a vertex to the next, at least 12
  };

  // Opening takes time and memory; Decode takes neither. Throws Error naming the file.
  static std::unique_ptr<Decoder> Open(const std::filesystem::path& avatar_file, const DecoderOptions& options = {});
  explicit Decoder(SafetensorsFile file, const DecoderOptions& options = {});

  // No view: the mesh alone. No mesh (null): the textures alone. The same input gives the same bytes, whatever the
  // number of threads. After construction nothing is allocated, locked or asked of the system, but for waking own
  // threads that sleep (see DecoderOptions::spin_ms) and yielding where a thread has no core. One call at a time on one
  // decoder; as many decoders as there is memory for. Throws Error, before anything is written, when sizes do not fit
  // or a value is not finite.
  //   code  [latent]
  void Decode(std::span<const float> code, std::span<const View> views, const Mesh& mesh,
              PixelFormat format = PixelFormat::kRgba8);

  // Derivatives of vertices by the code: those of x, y and z of the k-th listed vertex are rows 3 k ... 3 k + 2 of
  // `out`, in millimetres for each unit of each of the code's values. An empty list means all vertices.
  //   out  [3 x vertices, latent]
  void Jacobian(std::span<const float> code, std::span<const int> vertices, std::span<float> out);

  const Architecture& architecture() const { return architecture_; }
  const std::string& kernel() const { return kernel_; }
  // Of the kernel, where it is of lower precision and was checked: with "auto".
  const KernelAccuracy* accuracy() const { return checked_ ? &accuracy_ : nullptr; }
  int64_t memory_bytes() const { return plan_->bytes(); }
  FrameCost Cost(int views, bool mesh) const { return plan_->Cost(views, mesh); }

  const std::vector<float>& mean_code() const { return mean_code_; }
  const std::vector<int32_t>& triangles() const { return triangles_; }        // [T, 3] vertex indices
  const std::vector<int32_t>& triangle_uvs() const { return triangle_uvs_; }  // [T, 3] indices into uvs
  const std::vector<float>& uvs() const { return uvs_; }                      // [U, 2], v up

 private:
  void ChoosePlan(const DecoderNetwork& network, const DecoderOptions& options);

  Architecture architecture_;
  std::vector<float> mean_code_, uvs_;
  std::vector<int32_t> triangles_, triangle_uvs_;
  std::string kernel_;
  KernelAccuracy accuracy_;
  bool checked_ = false;
  std::shared_ptr<Team> team_;
  std::unique_ptr<Plan> plan_;
};

}  // namespace likeness
