// The captures that one network is trained on, one for each person.

#pragma once

#include <memory>
#include <string>
#include <vector>

#include "likeness/capture/capture.h"
#include "likeness/texture/texture_set.h"
#include "likeness/train/options.h"

namespace likeness {

// What a topology has otherwise than the first, in words; empty: nothing.
std::string TopologyDifference(const MeshTopology& first, const MeshTopology& other);

class People {
 public:
  // Opens options.capture and options.also. Throws Error where one is wrong, is not unwrapped at the size of the run,
  // has another topology than the first, or has the name of another.
  explicit People(const TrainOptions& options);

  const std::vector<std::string>& names() const { return names_; }
  const std::vector<std::unique_ptr<Capture>>& captures() const { return captures_; }
  std::vector<const TextureSet*> textures() const;
  int size() const { return textures_.front()->size(); }  // texels a side
  const MeshTopology& topology() const { return captures_.front()->topology(); }

 private:
  std::vector<std::string> names_;
  std::vector<std::unique_ptr<Capture>> captures_;
  std::vector<std::unique_ptr<TextureSet>> textures_;
};

}  // namespace likeness
