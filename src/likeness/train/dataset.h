// What training reads of unwrapped captures, one for each person: the training cameras' textures of the training
// frames, with meshes, averages and named conditions, kept packed where they fit.

#pragma once

#include <torch/types.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "likeness/capture/capture.h"
#include "likeness/texture/texture_set.h"
#include "likeness/train/standardise.h"
#include "likeness/train/texel_weights.h"
#include "likeness/train/texture_cache.h"

namespace likeness {

// Some textures with what the network needs to predict them; standardised, float32, on the CPU. F frames, N textures,
// N a multiple of F: texture n belongs to frame n / (N / F). Textures are stored row by row with channels interleaved
// ("channels last") and seen as [., 3, S, S].
struct Batch {
  torch::Tensor average;        // [F, 3, S, S]; 0 where no camera sees a texel
  torch::Tensor vertices;       // [F, 3 V]
  torch::Tensor texture;        // [N, 3, S, S]; 0 where not seen
  torch::Tensor seen;           // [N, 1, S, S]; the loss's weight w, 0 where not seen
  torch::Tensor view;           // [N, 3]
  torch::Tensor camera = {};    // [N] int64, index among the training cameras of all people
  torch::Tensor identity = {};  // [F] int64, index among the people
  torch::Tensor named = {};     // [F, values] named conditions, standardised; no values where there are none
};

class Dataset {
 public:
  // One texture.
  struct Sample {
    int frame = 0;  // index into frames()
    std::string camera;
    int camera_index = 0;  // among the training cameras of all people
    Eigen::Vector3f view;  // head space
  };

  // Reads meshes, statistics and conditions now, textures when they are first needed. Throws Error when nothing is left
  // to train on, when a file is absent or wrong, or when a condition has another size for another person. Textures are
  // borrowed, and of one size.
  //   people        the textures of each person's capture, at least one
  //   conditions    names of those that every capture has
  //   cache_bytes   of memory for textures
  //   cache_folder  for those that it does not hold; empty: they are read again
  Dataset(std::vector<const TextureSet*> people, const std::vector<std::string>& conditions, size_t cache_bytes,
          TexelWeighting weighting = TexelWeighting::kAll, const std::filesystem::path& cache_folder = {});
  // Of one person, without conditions.
  Dataset(const TextureSet& textures, size_t cache_bytes, TexelWeighting weighting = TexelWeighting::kAll,
          const std::filesystem::path& cache_folder = {})
      : Dataset({&textures}, {}, cache_bytes, weighting, cache_folder) {}
  Dataset(const Dataset&) = delete;
  Dataset& operator=(const Dataset&) = delete;

  int size() const { return people_.front()->size(); }
  int people() const { return static_cast<int>(people_.size()); }
  int cameras() const { return static_cast<int>(training_cameras_.size()); }  // for training, of all people
  const std::vector<FrameId>& frames() const { return frames_; }
  int IdentityOf(int frame) const { return identities_[frame]; }
  const std::vector<Sample>& samples() const { return samples_; }
  // Indices into samples(), for every frame.
  const std::vector<std::vector<int>>& samples_of_frame() const { return samples_of_frame_; }
  // The means are the person's own; the deviations are everybody's about their own means.
  const Statistics& statistics(int identity = 0) const { return statistics_[identity]; }

  const std::vector<NamedCondition>& conditions() const { return conditions_; }
  // A frame's values of all conditions, as captured.
  const std::vector<float>& ConditionsOf(int frame) const { return condition_values_[frame]; }
  // [values]: of each value over the training frames, and of each condition about its values' means.
  const std::vector<float>& condition_mean() const { return condition_mean_; }
  const std::vector<float>& condition_deviation() const { return condition_deviation_; }

  const TextureCache& cache() const { return *cache_; }

  // What a batch is made of, as it lies in the cache.
  struct Fetched {
    std::vector<int> samples;
    std::vector<std::shared_ptr<const PackedTexture>> textures;  // of the samples
    std::vector<int> frames;
    std::vector<std::shared_ptr<const PackedTexture>> averages;  // of the frames
  };
  // The slow part where textures must be read and decoded. `samples` come in groups of `views` that share a frame. Safe
  // from several threads.
  Fetched Fetch(const std::vector<int>& samples, int views) const;
  // The quick part, on all of LibTorch's threads.
  Batch Standardise(const Fetched& fetched) const;
  Batch Read(const std::vector<int>& samples, int views) const { return Standardise(Fetch(samples, views)); }

  // What it takes to encode frames [begin, end), without textures and views.
  Batch ReadFrames(int begin, int end) const;

 private:
  PackedTexture LoadTexels(int slot) const;
  void FetchAverages(Fetched* fetched) const;
  void AddPerson(int identity);
  void ReadStatistics();
  void ReadConditions(const std::vector<std::string>& names);

  std::vector<const TextureSet*> people_;
  std::vector<FrameId> frames_;
  std::vector<int> identities_;  // of frames
  std::vector<TrackedFrame> tracked_;
  std::vector<Camera> training_cameras_;  // of all people, one after another
  TexelWeights texel_weights_;
  std::vector<Sample> samples_;
  std::vector<std::vector<int>> samples_of_frame_;
  std::vector<Statistics> statistics_;
  std::vector<NamedCondition> conditions_;
  std::vector<std::vector<float>> condition_values_;  // of frames
  std::vector<float> condition_mean_, condition_deviation_;
  std::unique_ptr<TextureCache> cache_;  // samples, then the frames' averages
};

// The order in which training sees the samples: a function of seed and position alone, so that a run can be taken up
// anywhere. An epoch shuffles every frame's samples, cuts them into groups of `views` (the last one takes some again)
// and shuffles the groups.
class SampleOrder {
 public:
  SampleOrder(std::vector<std::vector<int>> samples_of_frame, int views, uint64_t seed);

  // The samples of batch `iteration`; `batch` is a multiple of views.
  std::vector<int> Samples(int64_t iteration, int batch) const;

  int64_t groups_per_epoch() const { return groups_per_epoch_; }

 private:
  std::vector<std::vector<int>> Epoch(int64_t epoch) const;

  std::vector<std::vector<int>> samples_of_frame_;
  int views_;
  uint64_t seed_;
  int64_t groups_per_epoch_ = 0;
};

}  // namespace likeness
