// What the processor gives a GPU for a frame: the code, and what the maps of the view make of each view, which are too
// small for a dispatch of their own.

#pragma once

#include <array>
#include <span>
#include <vector>

#include "likeness/decode/network.h"

namespace likeness {

class GlFrame {
 public:
  explicit GlFrame(const DecoderNetwork& network);

  // Arguments have been checked. `directions` holds 0 to kMostViews unit vectors.
  void Write(std::span<const float> code, std::span<const std::array<float, 3>> directions);

  // Begins with the code. Everything begins at a multiple of four values and is padded with zeros to one.
  std::span<const float> values() const { return values_; }

  // Inputs that each view has of its own, [view][view_in()], from view_at() on: its features, or in bilinear models
  // its coordinates times the code. None where the view is added in every layer.
  int view_in() const { return view_in_; }
  int view_at() const { return view_at_; }

  // What is added to the input of a convolution, [view][padded channels], begins here; -1: nothing is.
  int AddAt(size_t layer) const { return layer < additions_.size() ? additions_[layer].at : -1; }

 private:
  struct Addition {
    DenseLayer layer;
    int at = -1, pitch = 0;
  };

  const int latent_;
  const bool bilinear_;
  const DenseLayer view_;
  int view_in_ = 0, view_at_ = 0;
  std::vector<Addition> additions_;
  std::vector<float> values_, features_;
};

}  // namespace likeness
