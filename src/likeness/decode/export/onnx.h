// The decoder as an ONNX model, which ONNX Runtime, browsers and game engines run. docs/onnx.md describes it.
//
//   code            [batch, latent]
//   view            [batch, 3], unit vectors from the head's centre to the viewer; not in linear models
//   condition.NAME  [batch, size], each named condition as captured
//   person          [batch] int64, of avatars of several people where all are exported
//   -> texture      [batch, 3, S, S], red, green and blue from 0 to 255 as in training, clamped; row 0 is v = 1
//   -> vertices     [batch, V, 3], x y z in mm, head space
//
// Goals: what the run-time decoder computes, by standard operators, with names that tell what is what. Non-goals:
// speed; the run-time library knows this network better than a general program can.

#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "likeness/decode/export/onnx_graph.h"

namespace likeness {

struct OnnxOptions {
  std::optional<int> person;            // one of the avatar's people; none: all of them, told apart by an input
  int64_t most_bytes = kMostOnnxBytes;  // of the file
};

// The whole file, in 32 bits. Throws Error naming the avatar's file when it is no avatar, when the run time does not
// decode it, or when the model would be too large for the format.
std::string OnnxBytes(const std::filesystem::path& avatar_file, const OnnxOptions& options = {});

}  // namespace likeness
