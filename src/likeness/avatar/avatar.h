// The avatar file: all that a program needs to show the person, or the people, that it was trained on.
// docs/avatar-file.md describes it.
//
// Goals: one safetensors file which any safetensors reader opens; complete (network, topology, texture coordinates,
// statistics, units, codes to start from); checked against the tensor registry when it is read. Non-goals: what
// training needs to go on (optimiser state, unfolded normalisation) stays in checkpoints.

#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "likeness/avatar/architecture.h"
#include "likeness/avatar/safetensors.h"
#include "likeness/geometry/mesh.h"
#include "likeness/image/image.h"

namespace likeness {

struct Tensor {
  std::vector<int64_t> shape;
  std::vector<float> values;
};

// Somebody whom the avatar shows. Textures and vertices are standardised about a person's own means, which leaves
// the face's changes to the code.
struct Identity {
  std::string name;      // the capture's folder; may be empty where there is but one person
  ImageF texture_mean;   // RGB, 0 ... 255, texture_size a side, row 0 is v = 1
  Vertices vertex_mean;  // mm, head space
};

// Mean code (mu) of one frame that the avatar was trained on.
struct FrameCode {
  std::string segment;
  std::string frame;
  std::vector<float> mu;               // [latent]
  int identity = 0;                    // whose frame it is
  std::vector<float> conditions = {};  // the frame's values of the named conditions, one after another, as captured
};

struct Avatar {
  Architecture architecture;
  MeshTopology topology;

  // The network works on standardised values: (texture - mean) / sqrt(variance), (vertices - mean) / sqrt(variance),
  // (condition - mean) / deviation.
  std::vector<Identity> identities = std::vector<Identity>(1);  // as many as the architecture has
  double texture_variance = 1;                                  // (0 ... 255)^2, of all people
  double vertex_variance = 1;                                   // mm^2, of all people
  std::vector<float> condition_mean;                            // [NamedChannels], a value each
  std::vector<float> condition_deviation;

  std::map<std::string, Tensor> weights;  // by the registry's names; normalisation is folded in
  std::vector<FrameCode> codes;           // of the training frames, in the capture's order

  std::map<std::string, std::string> training;  // how it was made: "iterations", "samples", "seed", ...

  // Throws Error unless everything fits the architecture and is finite. `what` opens the message.
  void Check(const std::string& what) const;
};

// The key of Avatar::training under which a person's training cameras stand, parted by blanks.
std::string TrainingCamerasKey(const Avatar& avatar, int identity);

// Writes the file whole or not at all. Throws Error as Check does, and when it cannot be written.
void SaveAvatar(const std::filesystem::path& path, const Avatar& avatar);

// Throws Error naming the file for anything that SaveAvatar would not have written.
Avatar LoadAvatar(const std::filesystem::path& path);
Avatar AvatarFrom(const SafetensorsFile& file);

}  // namespace likeness
