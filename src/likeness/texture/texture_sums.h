// Means and variances over unwrapped views. All sums are whole numbers, so the order of views does not matter.

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/geometry/mesh.h"
#include "likeness/image/image.h"
#include "likeness/texture/unwrap.h"

namespace likeness {

class TextureSums {
 public:
  explicit TextureSums(int size);

  void Add(const UnwrappedView& view);
  void Add(const TextureSums& other);

  int64_t views() const { return views_; }

  // sum(w T) / sum(w) over the views (Lombardi et al. 2018, equation 1), rounded; 0 where no view sees the texel.
  ImageU8 Average() const;

  // As Average(), but texels that no view sees continue their neighbours smoothly: the mean texture is also what an
  // avatar shows between the charts, where filtering would otherwise draw dark seams.
  ImageU8 FilledAverage() const;

  // Mean squared distance of all seen texels and channels from the (unrounded) average, 0 ... 255 squared.
  double Variance() const;

  // A file's bytes, for sums that processes share: a line of text, then little-endian numbers.
  std::string Bytes() const;
  // Throws Error naming the file for anything that Bytes() of sums of this size would not have given.
  static TextureSums Parse(const std::filesystem::path& path_for_errors, std::string_view bytes, int size);

 private:
  int size_ = 0;
  int64_t views_ = 0;
  std::vector<uint32_t> colours_;  // sum(w T), 3 a texel
  std::vector<uint32_t> counts_;   // sum(w)
  uint64_t squares_ = 0;           // sum(w T^2) over texels and channels
};

// Mean of each vertex coordinate and the mean squared distance of all coordinates from it.
class VertexSums {
 public:
  void Add(const Vertices& vertices);
  std::vector<float> Mean() const;  // 3 a vertex, mm
  double Variance() const;          // mm squared

 private:
  int64_t frames_ = 0;
  Eigen::ArrayXd sums_, squares_;  // of distances from the first mesh, which keeps digits
  Vertices first_;
};

}  // namespace likeness
